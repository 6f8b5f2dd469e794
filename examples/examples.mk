# ---- examples ----

# Shared code lies in the folders of examples/common, here from the highest to the lowest. A folder is a static library. It may
# include the folders of its _USES, and what those use; _LIBS are the libraries it needs. A folder or program that wants packages is a
# group of .ci/deps.sh.
EXAMPLE_FOLDERS   = solids springls character registration shapes imaging surface pictures base

solids_USES       = springls surface
springls_USES     = pictures
character_USES    = shapes surface
registration_USES = imaging
shapes_USES       = pictures
imaging_USES      = pictures
surface_USES      = pictures
pictures_USES     = base

registration_LIBS = -llapacke
shapes_LIBS       = -llapacke
pictures_LIBS     = -lz
imaging_LIBS      = -lnifti2 -lznz -lteem -lz $(if $(GDCM),-lgdcmMSFF -lgdcmDSED -lgdcmCommon) $(if $(MAXFLOW),-lmaxflow) -lstdc++
surface_LIBS      = -lassimp -lcjson -lmeshoptimizer -ldraco -lstdc++

# A program is a file of examples/ or a folder. minimal and engine_embed use the library alone.
leveque_USES      = springls
zalesak_USES      = springls
fluid_skin_USES   = springls
soft_body_USES    = springls
attributes_USES   = springls
csg_USES          = solids
foam_USES         = springls surface
mend_USES         = solids
segment_USES      = springls surface imaging
surfaces_USES     = springls surface imaging
register_USES     = springls surface registration
track4d_USES      = springls surface shapes registration
atlas_USES        = springls surface shapes registration
morph_USES        = springls character
rig_USES          = springls character
viewer_USES       = springls surface

atlas_LIBS        = -lcjson
viewer_LIBS       = -lglfw -lepoxy

EXAMPLES := $(basename $(notdir $(filter-out examples/common examples/pictures examples/python examples/web examples/engines examples/recipes examples/cohort %.mk,$(wildcard examples/*))))

# $(call folders,NAMES): these folders and all they use, the highest first. Of these: sources, archives, libraries. Of programs:
# groups of .ci/deps.sh.
uses            = $(foreach f,$(1),$(f) $(call uses,$($(f)_USES)))
folders         = $(filter $(call uses,$(1)),$(EXAMPLE_FOLDERS))
folder_sources  = $(foreach f,$(call folders,$(1)),$(wildcard examples/common/$(f)/*.c examples/common/$(f)/*.cpp))
folder_archives = $(patsubst %,build/examples/common/%.a,$(call folders,$(1)))
folder_libs     = -Wl,--as-needed $(foreach f,$(call folders,$(1)),$($(f)_LIBS)) -lm -pthread
packages        = $(call folders,$(foreach p,$(1),$($(p)_USES))) $(filter atlas viewer engine_embed,$(1))
objects         = $(patsubst examples/%,build/examples/%.o,$(basename $(wildcard examples/$(1).c examples/$(1)/*.c examples/$(1)/*.cpp)))

# Before anything is compiled: a compiler, and the packages of the programs that were asked for.
.PHONY: set-up
set-up: WANTED = $(filter $(EXAMPLES),$(patsubst build/%,%,$(MAKECMDGOALS)))
set-up:
	@$(DEPS) make $(call packages,$(WANTED))

build/examples/%.o: examples/%.c build/examples/settings | springls.h set-up
	@mkdir -p $(@D)
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -I. -Iexamples -Iexamples/common -MMD -MP -c -o $@ $<

# Libraries that are C++ have a face in C.
build/examples/%.o: examples/%.cpp build/examples/settings | set-up
	@mkdir -p $(@D)
	$(SAY)$(CXX) $(filter-out -std=c99,$(EXAMPLE_FLAGS)) -std=c++17 -Iexamples/common -MMD -MP -c -o $@ $<

define folder_rule
build/examples/common/$(1).a: $(call objects,common/$(1))
	@rm -f $$@
	$$(SAY)$$(AR) rcs $$@ $$^
endef
$(foreach f,$(EXAMPLE_FOLDERS),$(eval $(call folder_rule,$(f))))

define program_rule
$(1): build/$(1)
build/$(1): $(call objects,$(1)) $(call folder_archives,$($(1)_USES))
	$$(SAY)$$(CC) $$(EXAMPLE_FLAGS) -o $$@ $$^ $($(1)_LIBS) $(call folder_libs,$($(1)_USES))
endef
$(foreach p,$(filter-out engine_embed,$(EXAMPLES)),$(eval $(call program_rule,$(p))))

# C++17, as engines are written.
engine_embed: build/engine_embed
build/engine_embed: examples/engine_embed.cpp build/examples/settings | springls.h set-up
	$(SAY)$(CXX) $(filter-out -std=c99,$(EXAMPLE_FLAGS)) -std=c++17 -I. -MMD -MP -MF build/examples/engine_embed.d -o $@ $< -lm

# Engines bring libraries along that nothing else wants.
OGRE_FLAGS = $(shell pkg-config --cflags OGRE 2> /dev/null | sed s/-I/-isystem/) -DOGRE_PLUGINS='"$(shell pkg-config --variable=plugindir OGRE 2> /dev/null)"'
engines: deps-engines   ## the library inside an engine, OGRE: build/ogre (--picture FILE.png; wants a display)
	@$(MAKE) --no-print-directory build/ogre
build/ogre: examples/engines/ogre.cpp build/examples/settings | springls.h
	$(SAY)$(CXX) $(filter-out -std=c99,$(EXAMPLE_FLAGS)) -std=c++17 -I. $(OGRE_FLAGS) -MMD -MP -MF build/examples/ogre.d -o $@ $< -lOgreMain -lm

# The module of Python and its examples. It reads the declarations of springls.h, which lies beside it.
PYTHON_FILES = springls.h springls.py segment.py track.py
python: deps-python build/python/libspringls.so $(PYTHON_FILES:%=build/python/%)   ## Python's module springls and two examples: build/python
build/python/libspringls.so: springls.h build/python/settings | deps-python
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -fPIC -shared -DSPRINGLS_IMPLEMENTATION -x c -o $@ $< -lm
build/python/springls.h: springls.h build/python/settings
	@cp $< $@
build/python/%.py: examples/python/%.py build/python/settings
	@cp $< $@
wheel: springls.h | deps-python   ## a wheel of Python's module, for pip, and the archive of its sources: build/python
	@mkdir -p build/python
	@CC="$(CC)" /usr/bin/python3 packages/python/backend.py sdist build/python
	@CC="$(CC)" /usr/bin/python3 packages/python/backend.py wheel build/python

# The viewer's sources without window and files, for a browser; and for this machine without drawing, to print the hashes that the
# page compares with. All is in one text, so that the page opens from a disk. Emscripten wants modules of Debian's Node. The SLP
# vectorizer of clang 14 changes results for WebAssembly.
WEB_SOURCES = examples/web/web.c examples/web/mesh_file.c $(patsubst %,examples/viewer/%.c,app camera file history model script solid tools) \
              $(patsubst %,examples/common/%.c,surface/mesh_write pictures/raycast_camera base/cli base/progress base/same_file base/output_file)
WEB_PICTURE = examples/viewer/gl.c examples/viewer/scene.c
WEB_FLAGS   = -std=c99 $(WARNINGS) $(EXACT) -O3 -I. -Iexamples -Iexamples/common
WEB_LINK    = --no-entry -sALLOW_MEMORY_GROWTH=1 -sMIN_WEBGL_VERSION=2 -sMAX_WEBGL_VERSION=2 -sSINGLE_FILE=1 \
              -sEXPORTED_RUNTIME_METHODS=cwrap,FS --embed-file examples/pictures/viewer.txt@strokes.txt
web: deps-web build/web/web.js build/web/native.js build/web/index.html   ## the viewer as a page for a browser: build/web/index.html
build/web/web.js: $(WEB_SOURCES) $(WEB_PICTURE) $(wildcard examples/viewer/*.h) examples/pictures/viewer.txt springls.h | deps-web
	@mkdir -p $(@D)
	$(SAY)NODE_PATH=/usr/share/nodejs emcc $(WEB_FLAGS) -msimd128 -fno-slp-vectorize $(WEB_LINK) -o $@ $(WEB_SOURCES) $(WEB_PICTURE)
build/web_native: $(WEB_SOURCES) $(wildcard examples/viewer/*.h) springls.h
	@mkdir -p $(@D)
	$(SAY)$(CC) $(WEB_FLAGS) -ffunction-sections -Wl,--gc-sections -o $@ $(WEB_SOURCES) -lm
build/web/native.js: build/web_native examples/pictures/viewer.txt
	@mkdir -p $(@D)
	@build/web_native examples/pictures/viewer.txt > $@
build/web/%.html: examples/web/%.html
	@mkdir -p $(@D)
	@cp $< $@

# The library for JavaScript: packages/npm has the sources, and npm runs make for what is compiled. Callbacks are imports,
# which Emscripten takes for functions that are missing.
build/npm/springls.wasm: packages/npm/springls.c springls.h | deps-npm
	@mkdir -p $(@D)
	$(SAY)NODE_PATH=/usr/share/nodejs emcc -std=c99 $(WARNINGS) $(EXACT) -O3 -I. -DSPRINGLS_NO_OPENCL -msimd128 -fno-slp-vectorize --no-entry \
	  -sALLOW_MEMORY_GROWTH=1 -sSTANDALONE_WASM=1 -sERROR_ON_UNDEFINED_SYMBOLS=0 -sWARN_ON_UNDEFINED_SYMBOLS=0 \
	  -Wl,-z,stack-size=1048576 -o $@ $<
npm: build/npm/springls.wasm   ## a package of the library for JavaScript, for npm install: build/npm
	@cd packages/npm && npm pack --silent --offline --pack-destination ../../build/npm

cohort: deps-cohort   ## what the workflow of examples/cohort wants: two programs, Snakemake
	@$(MAKE) $(PARALLEL) atlas register

.PHONY: $(EXAMPLES) python engines npm cohort check-folders
examples:   ## build every program of examples/ into build/ (or one: make leveque)
	@$(MAKE) $(PARALLEL) $(EXAMPLES)

# Refuses an include of a folder that its own does not use.
check-folders:
	@$(foreach f,$(EXAMPLE_FOLDERS),! grep -nE '#include "(\.\./)?($(subst $() $(),|,$(filter-out $(call folders,$(f)),$(EXAMPLE_FOLDERS))))(_cl)?[/.]' \
	  examples/common/$(f)/*.[ch] &&) true || { echo "check: examples.mk allows no such include"; exit 1; }

HEAD_SCAN  ?= /usr/share/mricron/templates/ch2bet.nii.gz
# Between fluid and grey matter of that scan.
HEAD_LEVEL ?= 72

# All processors work without a -j of the user's, and what they print stays together.
PARALLEL = --no-print-directory $(if $(findstring -j,$(MAKEFLAGS)),,-j$(shell nproc 2> /dev/null || echo 2) --output-sync=target)

DEMO = leveque zalesak segment
demo:   ## from nothing to results: set-up, build, two programs run into build/demo/
	@$(DEPS) make scan $(call packages,$(DEMO))
	@$(MAKE) $(PARALLEL) $(DEMO)
	@mkdir -p build/demo
	build/leveque --grid 64 --period 1.25 --out build/demo
	build/segment $(HEAD_SCAN) --level $(HEAD_LEVEL) --grid 128 --out build/demo/brain
	@echo "see build/demo/"

-include $(wildcard build/examples/*.d build/examples/*/*.d build/examples/*/*/*.d)
