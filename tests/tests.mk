# ---- tests ----

# Tests of a sanitizer and tests of the parts live in folders of their own, beside the plain ones. Tests have OpenCL where its
# headers are. The library is what runs for long: -O3 takes a quarter more time to compile than -O2, and a fifth less to run, but not
# under a sanitizer, and without SIMD -O1 would take three times as long. Tests themselves are compiled in the shortest time, and what
# has code of programs or of the library in it with -O1.
TEST_DIR     := build/test$(addprefix -,$(VARIANT))$(if $(filter 1,$(PARTS)),-parts)
TEST_FLAGS    = $(STRICT) $(or $(OPT),$(LEVEL)) $(MACHINE) $(THREADS) $(if $(filter 1,$(PARTS)),-DSPRINGLS_PARTS) \
                $(if $(filter 1,$(WITH_OPENCL) $(WITH_LIBRARIES)),-DSPRINGLS_TEST_OPENCL) -I. -Itests -MMD -MP -MF $@.d $(SANITIZE) $(CFLAGS)
TEST_LIBS     = -lm -pthread
LEVEL         = -O0
$(TEST_DIR)/backend/% $(TEST_DIR)/examples/% $(TEST_DIR)/objects/% $(addprefix $(TEST_DIR)%unit/test_,fill_gaps.o raycast.o): LEVEL = -O1
$(TEST_DIR)/settings $(TEST_DIR)-no-simd/settings: SETTINGS += $(WITH_LIBRARIES) $(WITH_OPENCL)

UNIT_TESTS    = $(patsubst tests/%.c,%,$(sort $(wildcard tests/unit/test_*.c)))
EXAMPLE_TESTS = $(patsubst tests/%.c,%,$(sort $(wildcard tests/examples/test_*.c)))

# ---- building: a test is linked with the library, which is compiled once for each set of flags ----

# $(1): a folder. $(2): flags more.
define unit_rules
$(1)/library.o: tests/library.c $(1)/settings | springls.h
	$$(SAY)$$(CC) $$(TEST_FLAGS) $$(or $$(OPT),$$(if $$(SANITIZE),-O2,-O3)) $(2) -c -o $$@ $$<

$(1)/%.o: tests/%.c $(1)/settings | springls.h
	@mkdir -p $$(@D)
	$$(SAY)$$(CC) $$(TEST_FLAGS) $(2) -c -o $$@ $$<

$(1)/%: $(1)/%.o $(1)/library.o
	@$$(CC) $$(TEST_FLAGS) -o $$@ $$< $(1)/library.o $$(TEST_LIBS)
endef
$(eval $(call unit_rules,$(TEST_DIR)))
$(eval $(call unit_rules,$(TEST_DIR)-no-simd,-DSPRINGLS_NO_SIMD))

# Without SIMD too, a test is the same object, unless parts of the library are compiled in it.
WITH_PARTS = $(patsubst tests/%.c,%,$(shell grep -l -e 'include "\.\./\.\./[ks]' -e springls_under_test -e SPRINGLS_NO_SIMD tests/*/*.c))
PUBLIC_TESTS = $(filter-out $(WITH_PARTS),$(UNIT_TESTS) portability/hashes)
$(PUBLIC_TESTS:%=$(TEST_DIR)-no-simd/%): $(TEST_DIR)-no-simd/%: $(TEST_DIR)/%.o $(TEST_DIR)-no-simd/library.o
	@mkdir -p $(@D)
	@$(CC) $(TEST_FLAGS) -o $@ $< $(TEST_DIR)-no-simd/library.o $(TEST_LIBS)

# The tests that are about OpenCL look into the library and springls_cl.h, and have them as their own. What fails on demand is a
# library that stands before OpenCL's.
$(TEST_DIR)/backend/test_%: tests/backend/test_%.c $(TEST_DIR)/settings | springls.h $(TEST_DIR)/backend/opencl_stub.so
	$(SAY)$(CC) $(TEST_FLAGS) -o $@ $< $(TEST_LIBS)
$(TEST_DIR)/backend/opencl_stub.so: tests/backend/opencl_stub.c $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CC) $(TEST_FLAGS) -shared -fPIC -o $@ $<

# The device whose kernels are compiled as C, for sanitizers to watch.
$(TEST_DIR)/backend/emulator.so: tests/backend/emulator.c tests/backend/opencl_kernels.c tests/backend/opencl_kernels.h \
  $(filter kernels_embed/%,$(PARTS_FILES)) $(wildcard kernels_embed/*/*.cl) $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CC) $(filter-out -M% $@.d,$(TEST_FLAGS)) -shared -fPIC -o $@ $(filter tests/%.c,$^) -lm

# Tests of the examples are linked with the folders of examples/common that they use (examples/examples.mk), compiled with the
# tests' flags. Where the libraries of these folders cannot be had, the tests skip themselves.
test_atlas_USES     = $(atlas_USES)
test_atlas_files_USES = $(atlas_USES)
test_atlas_fusion_USES = $(atlas_USES)
test_atlas_ragged_USES = $(atlas_USES)
test_atlas_segment_USES = $(atlas_USES)
test_atlas_shapes_USES = $(atlas_USES)
test_bad_files_USES = surface imaging
test_common_USES    = surface imaging springls
test_contour_USES   = $(segment_USES)
test_csg_USES       = $(csg_USES)
test_foam_USES      = $(foam_USES)
test_dicom_USES     = imaging
test_mend_USES      = $(mend_USES)
test_gltf_USES      = character
test_fields_USES    = $(register_USES)
test_imaging_USES   = pictures
test_morph_USES     = $(morph_USES)
test_morph_files_USES = $(morph_USES)
test_morph_shapes_USES = $(morph_USES)
test_morph_skeletons_USES = $(morph_USES)
test_register_USES  = $(register_USES)
test_results_USES   = springls
test_rig_USES       = $(rig_USES)
test_segment_USES   = imaging
test_soft_body_USES = $(soft_body_USES)
test_surfaces_USES  = $(surfaces_USES)
test_track_USES     = $(track4d_USES)
test_viewer_USES    = $(viewer_USES)
test_viewer_events_USES = $(viewer_USES)
test_viewer_tools_USES = $(viewer_USES)
test_volume_USES    = imaging
test_volume_raycast_USES = springls
test_atlas_LIBS     = $(atlas_LIBS)
test_atlas_files_LIBS = $(atlas_LIBS)
test_atlas_fusion_LIBS = $(atlas_LIBS)
test_atlas_ragged_LIBS = $(atlas_LIBS)
test_atlas_segment_LIBS = $(atlas_LIBS)
test_atlas_shapes_LIBS = $(atlas_LIBS)
test_imaging_LIBS   = -lcjson
test_viewer_LIBS    = $(viewer_LIBS)
test_viewer_events_LIBS = $(viewer_LIBS)
test_viewer_tools_LIBS = $(viewer_LIBS)
# Sources of a program that its tests are linked with, which are all but those that they include: $(2), with program.c. The other
# tests of programs include all of them.
sources_but = $(filter-out $(patsubst %,examples/$(1)/%.c,$(1) $(2)),$(wildcard examples/$(1)/*.c))
test_atlas_SOURCES = $(call sources_but,atlas)
test_atlas_files_SOURCES = $(call sources_but,atlas)
test_atlas_fusion_SOURCES = $(call sources_but,atlas)
test_atlas_ragged_SOURCES = $(call sources_but,atlas)
test_atlas_segment_SOURCES = $(call sources_but,atlas)
test_atlas_shapes_SOURCES = $(call sources_but,atlas)
test_register_SOURCES = $(call sources_but,register)
test_surfaces_SOURCES = $(call sources_but,surfaces)
test_morph_SOURCES = $(call sources_but,morph)
test_morph_files_SOURCES = $(call sources_but,morph)
test_morph_shapes_SOURCES = $(call sources_but,morph)
test_morph_skeletons_SOURCES = $(call sources_but,morph,skinning)
test_viewer_SOURCES = $(call sources_but,viewer,window)
test_viewer_events_SOURCES = $(call sources_but,viewer)
test_viewer_tools_SOURCES = $(call sources_but,viewer,tools)

test_objects = $(patsubst examples/%,$(TEST_DIR)/objects/%.o,$(basename $(filter-out %/implementation.c,$($(1)_SOURCES) $(call folder_sources,$($(1)_USES)))))
EXAMPLE_TEST_FLAGS = $(TEST_FLAGS) $(NIFTI) -Iexamples -Iexamples/common -DTEST_EXAMPLES_COMMON

$(TEST_DIR)/objects/%.o: examples/%.c $(TEST_DIR)/settings | springls.h
	@mkdir -p $(@D)
	$(SAY)$(CC) $(EXAMPLE_TEST_FLAGS) -c -o $@ $<
$(TEST_DIR)/objects/%.o: examples/%.cpp $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CXX) $(filter-out -std=c99,$(EXAMPLE_TEST_FLAGS)) -std=c++17 $(NO_TYPES) -c -o $@ $<

define example_test_rule
$(TEST_DIR)/examples/$(1): tests/examples/$(1).c $(call test_objects,$(1)) $(TEST_DIR)/library.o $(TEST_DIR)/settings
	@mkdir -p $$(@D)
	$$(SAY)$$(CC) $$(EXAMPLE_TEST_FLAGS) -o $$@ $$< $(call test_objects,$(1)) $(TEST_DIR)/library.o $($(1)_LIBS) $(call folder_libs,$($(1)_USES))
endef
ifeq ($(WITH_LIBRARIES),1)
$(foreach t,$(notdir $(EXAMPLE_TESTS)),$(eval $(call example_test_rule,$(t))))
endif

# The fuzzers as tests: their seeds and some random inputs.
FUZZERS           = $(patsubst tests/fuzz/fuzz_%.c,%,$(sort $(wildcard tests/fuzz/fuzz_*.c)))
fuzz_volume_USES  = imaging
fuzz_surface_USES = character
fuzz_command_USES = base
fuzz_files_USES   = character registration
define fuzz_rule
$(TEST_DIR)/fuzz/fuzz_$(1): tests/fuzz/fuzz_$(1).c tests/fuzz/replay.c $(call test_objects,fuzz_$(1)) $(TEST_DIR)/library.o $(TEST_DIR)/settings
	@mkdir -p $$(@D)
	$$(SAY)$$(CC) $$(EXAMPLE_TEST_FLAGS) -DFUZZ_NAME='"$(1)"' -o $$@ $$< tests/fuzz/replay.c $(call test_objects,fuzz_$(1)) $(TEST_DIR)/library.o \
	  $(call folder_libs,$(fuzz_$(1)_USES))
endef
# Those that read files want the libraries of the examples.
FUZZ_TESTS = $(patsubst %,fuzz/fuzz_%,$(if $(filter 1,$(WITH_LIBRARIES)),$(FUZZERS),$(filter-out files volume surface,$(FUZZERS))))
$(foreach f,$(FUZZERS),$(eval $(call fuzz_rule,$(f))))

# C++: the engine's game loop with the code of docs/engine.md, and the program in OGRE, which have the library as their own; and OpenVDB
# and CGAL beside the library. OGRE, OpenVDB and CGAL where they are installed.
CXX_TEST_FLAGS = $(filter-out -std=c99,$(TEST_FLAGS)) -std=c++17
$(TEST_DIR)/examples/test_engine: tests/examples/test_engine.cc docs/engine.md $(TEST_DIR)/settings | springls.h
	@mkdir -p $(@D)
	@sed -n '/^```cpp/,/^```$$/{/^```/!p}' docs/engine.md > $(TEST_DIR)/engine_sample.h
	$(SAY)$(CXX) $(CXX_TEST_FLAGS) -I$(TEST_DIR) -o $@ $< $(TEST_LIBS)
$(TEST_DIR)/examples/test_ogre: tests/examples/test_ogre.cc examples/engines/ogre.cpp $(TEST_DIR)/settings | springls.h
	@mkdir -p $(@D)
	$(SAY)$(CXX) $(filter-out $(WARNINGS),$(CXX_TEST_FLAGS)) $(OGRE_FLAGS) -o $@ $< $(if $(wildcard /usr/include/OGRE/Ogre.h),-lOgreMain) $(TEST_LIBS)
$(TEST_DIR)/unit/test_openvdb: tests/unit/test_openvdb.cc $(TEST_DIR)/library.o $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CXX) $(filter-out $(WARNINGS),$(CXX_TEST_FLAGS)) -o $@ $< $(TEST_DIR)/library.o -Wl,--copy-dt-needed-entries,--as-needed \
	  $(if $(wildcard /usr/include/openvdb/openvdb.h),-lopenvdb -ltbb) $(TEST_LIBS)
$(TEST_DIR)/unit/test_self_intersections: tests/unit/test_self_intersections.cc tests/long_lives.h $(TEST_DIR)/library.o $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CXX) $(filter-out $(WARNINGS),$(CXX_TEST_FLAGS)) -o $@ $< $(TEST_DIR)/library.o \
	  $(if $(wildcard /usr/include/CGAL/Polygon_mesh_processing/self_intersections.h),-lgmp -lmpfr) $(TEST_LIBS)

# A program that is Python's, and skipped where that is missing.
define python_program
@printf '%s\n' '#!/bin/sh' '[ -x /usr/bin/python3 ] || { echo "there is no Python"; echo "Pass: 0, fail: 0, skip: 1."; exit; }' \
  'exec /usr/bin/python3 $(1) "$$@"' > $@
@chmod +x $@
endef

# Python's module, its doctests and two examples, with a library of its own: a sanitizer's cannot be loaded into Python.
$(TEST_DIR)/examples/test_python: tests/examples/test_python.py $(wildcard examples/python/*.py) $(TEST_DIR)/settings | springls.h
	@mkdir -p $(@D)/python
	@cp springls.h examples/python/*.py $< $(@D)/python
	$(SAY)$(CC) $(STRICT) -O1 -fPIC -shared $(THREADS) -DSPRINGLS_IMPLEMENTATION -x c -o $(@D)/python/libspringls.so springls.h -lm
	$(call python_program,$(@D)/python/test_python.py)

# The module and segment beside scikit-image and scipy.
$(TEST_DIR)/examples/test_judges: tests/examples/test_judges.py $(TEST_DIR)/examples/test_python $(if $(filter 1,$(WITH_LIBRARIES)),build/segment)
	@cp $< $(@D)/python
	$(call python_program,$(@D)/python/test_judges.py)

# The workflow of cohorts. Under a sanitizer it is left out: it runs the programs as they are.
$(TEST_DIR)/examples/test_cohort: tests/examples/test_cohort.py $(TEST_DIR)/settings $(if $(filter 1,$(WITH_LIBRARIES)),build/atlas build/register)
	@mkdir -p $(@D)
	$(call python_program,tests/examples/test_cohort.py)

# Images after reports of users, by the programs as they are.
$(TEST_DIR)/examples/test_image_reports: tests/examples/test_image_reports.py $(TEST_DIR)/settings \
  $(if $(filter 1,$(WITH_LIBRARIES)),build/segment build/register build/surfaces)
	@mkdir -p $(@D)
	$(call python_program,tests/examples/test_image_reports.py)

# What the pages say: their quick figures, and that what their commands name exists.
$(TEST_DIR)/examples/test_pages: tests/examples/test_pages.py $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(call python_program,tests/examples/test_pages.py)

# ---- running: every program leaves a log; as many run at a time as there are processors ----

# `make test` takes TESTS=quick, `make test-rest` what that leaves out; without TESTS it is all of them, as `make test-all` runs them.
# $(call chosen,QUICK,ALL): of two lists.
chosen = $(if $(filter quick,$(TESTS)),$(1),$(if $(filter rest,$(TESTS)),$(filter-out $(1),$(2)),$(2)))
# Quick on every backend are the tests of stages, on the scalar one all but those that take long and those that compare with what other
# programs say.
STAGE_TESTS   = $(addprefix unit/test_,advect relax contract resample evolve rebuild fill_gaps unsigned_to_signed track)
JUDGED_TESTS  = unit/test_openvdb $(if $(VARIANT),,unit/test_self_intersections examples/test_judges examples/test_ogre examples/test_cohort examples/test_image_reports)
# Those of morph ask the glTF validator, which comes by npm, and the others take long.
LATER_TESTS   = $(JUDGED_TESTS) $(addprefix unit/test_,chunk_lod determinism mesh_parts metric metric_reads more_lives nearby top_table) \
                $(filter $(addprefix examples/test_,atlas% contour csg foam mend morph morph_files register rig track viewer viewer_events viewer_tools),$(EXAMPLE_TESTS))

ALL_PLAIN     = $(EXAMPLE_TESTS) $(FUZZ_TESTS) examples/test_engine $(if $(VARIANT),,examples/test_python examples/test_pages) \
                $(UNIT_TESTS) $(JUDGED_TESTS)
PLAIN_TESTS   = $(call chosen,$(filter-out $(LATER_TESTS),$(ALL_PLAIN)),$(ALL_PLAIN))
# Under a sanitizer quick are the tests of stages, and of what is read from outside, saved and allocated.
SANITIZED_TESTS = $(STAGE_TESTS) $(addprefix unit/test_,allocation bad_input chunks chunk_regions contouring lives not_finite query reading set_dirty_mesh set_mesh set_springls \
                snapshot) $(addprefix examples/test_,bad_files common gltf mend volume) $(FUZZ_TESTS)
ifeq ($(VARIANT),asan)
  PLAIN_TESTS = $(call chosen,$(SANITIZED_TESTS),$(ALL_PLAIN))
endif
# MemorySanitizer needs all of a program compiled with it, other libraries too.
ifeq ($(VARIANT),msan)
  PLAIN_TESTS = $(call chosen,$(STAGE_TESTS) $(addprefix unit/test_,lives reading snapshot),$(UNIT_TESTS))
endif
# ThreadSanitizer takes twenty times the time, and finds nothing where there is one thread: without ALL=1 it gets the tests that start some.
# Quick are whole lives of models on threads, and the pool of threads.
ifeq ($(VARIANT)$(ALL),tsan)
  PLAIN_TESTS = $(call chosen,examples/test_engine $(addprefix unit/test_,context determinism threads),examples/test_engine \
                $(patsubst tests/%.c,%,$(shell grep -l -e pthread -e fixture_tasks -e histories.h tests/unit/test_*.c)))
endif
# The tests of the library once more without SIMD, and once more with their contexts on OpenCL.
ALL_LIBRARY   = $(patsubst tests/%.c,%,$(shell grep -l -e 'include "fixtures.h"' -e 'include "histories.h"' tests/unit/test_*.c)) portability/same_hashes
LIBRARY_TESTS = $(call chosen,$(STAGE_TESTS) portability/same_hashes,$(ALL_LIBRARY))
ALL_DEVICE    = $(patsubst tests/%.c,%,$(shell grep -l -E 'fixture_(context|desc|sphere|box|torus)|histories' tests/unit/test_*.c) \
                $(wildcard tests/backend/test_*.c)) backend/opencl_small
DEVICE_TESTS  = $(if $(WITH_OPENCL),$(call chosen,$(STAGE_TESTS) backend/opencl_small,$(ALL_DEVICE)))
# On a processor with the kernels of a GPU, which PoCL compiles in 45 s.
ALL_GROUP     = backend/opencl_small backend/test_opencl_parity
GROUP_TESTS   = $(if $(WITH_OPENCL),$(call chosen,,$(ALL_GROUP)))
ifneq ($(VARIANT)$(filter 1,$(PARTS)),)
  # What a driver does with memory and threads is its own affair, and the parts have no text for a device.
  DEVICE_TESTS := $(if $(filter cover,$(VARIANT)),$(DEVICE_TESTS))
  GROUP_TESTS =
  LIBRARY_TESTS =
endif
# And some on the device of emulator.so, whose kernels sanitizers watch.
ALL_CHECKED   = backend/test_opencl_parity $(if $(filter tsan,$(VARIANT)),,unit/test_lives)
CHECKED_TESTS = $(if $(filter 1,$(PARTS)),,$(if $(WITH_OPENCL),$(if $(filter quick,$(TESTS)),backend/test_opencl_parity,$(ALL_CHECKED))))
# Quick, and not too long for ThreadSanitizer: each scenario as a whole, not kernel by kernel.
CHECKED_PART  = $(if $(filter quick,$(TESTS))$(filter tsan,$(VARIANT)),-s scenarios -t same_bits)
# What takes a minute runs once, optimised: bits are the same in every build.
ACCURACY_LOG = $(if $(filter 1,$(WITH_LIBRARIES)),build/bench/accuracy.log)
# The page of promises names what there is; what runs tests has a test.
SCRIPT_LOGS  = $(TEST_DIR)/trust.log $(TEST_DIR)/test_run.log
SCALAR_LOGS  = $(PLAIN_TESTS:%=$(TEST_DIR)/%.log) $(if $(VARIANT)$(filter 1,$(PARTS)),,$(call chosen,$(SCRIPT_LOGS),$(SCRIPT_LOGS) $(ACCURACY_LOG)))
NO_SIMD_LOGS = $(LIBRARY_TESTS:%=$(TEST_DIR)-no-simd/%.log)
# The script for machines with a GPU, small.
DEVICE_SCRIPT_LOG = $(if $(DEVICE_TESTS),$(if $(VARIANT),,$(call chosen,,build/test/device/run.log)))
OPENCL_LOGS  = $(DEVICE_TESTS:%=$(TEST_DIR)/%.opencl.log) $(DEVICE_SCRIPT_LOG)
GROUP_LOGS   = $(GROUP_TESTS:%=$(TEST_DIR)/%.group.log)
CHECKED_LOGS = $(CHECKED_TESTS:%=$(TEST_DIR)/%.checked.log)

# The first program on OpenCL compiles the kernels into PoCL's cache, where the others find them.
FIRST_OPENCL_LOG = $(firstword $(OPENCL_LOGS))
$(filter-out $(FIRST_OPENCL_LOG),$(OPENCL_LOGS)): | $(FIRST_OPENCL_LOG)
$(wordlist 2,9,$(GROUP_LOGS)): | $(firstword $(GROUP_LOGS))

DEVICE_PROGRAMS = build/leveque build/zalesak build/test/device/report $(addprefix build/test/,backend/test_opencl_parity backend/test_opencl_transfers \
                  unit/test_determinism)
build/test/device/report: tests/device/report.c build/test/settings | springls.h
	@mkdir -p $(@D)
	$(SAY)$(CC) $(TEST_FLAGS) -O2 -DSPRINGLS_TEST_OPENCL -o $@ $< $(TEST_LIBS)

%.opencl.log: % FORCE
	@echo "  run $< on OpenCL"; SPRINGLS_TEST_BACKEND=cpu tests/run.sh $@ $<
%.group.log: % FORCE
	@echo "  run $< on OpenCL, in groups"; SPRINGLS_TEST_BACKEND=group tests/run.sh $@ $<
%.checked.log: % $(TEST_DIR)/backend/emulator.so FORCE
	@echo "  run $< on a checked device"; SPRINGLS_TEST_BACKEND=gpu SPRINGLS_TEST_LIBRARY=$(TEST_DIR)/backend/emulator.so \
	  tests/run.sh $@ $< $(if $(filter %/test_opencl_parity,$<),$(CHECKED_PART))
%.log: % FORCE
	@echo "  run $<"; tests/run.sh $@ $<
build/test/device/run.log: tests/device/run.sh $(DEVICE_PROGRAMS) FORCE
	@echo "  run $<"; PARTS="flows kernels brush" GRIDS=24 GRID=24 LIMIT=300 tests/run.sh $@ $<
$(SCRIPT_LOGS): $(TEST_DIR)/%.log: tests/%.sh FORCE
	@mkdir -p $(@D)
	@echo "  run $<"; tests/run.sh $@ $<
$(TEST_DIR)-no-simd/portability/same_hashes.log: $(TEST_DIR)/portability/hashes $(TEST_DIR)-no-simd/portability/hashes FORCE
	@tests/run.sh $@ tests/portability/same_hashes.sh $(filter-out FORCE,$^)

# Those of the checked device take longest, and begin first: nothing is left to one processor at the end.
test-run: $(FIRST_OPENCL_LOG) $(CHECKED_LOGS) $(SCALAR_LOGS) $(NO_SIMD_LOGS) $(OPENCL_LOGS) $(GROUP_LOGS)
	@tests/report.sh scalar $(SCALAR_LOGS) $(if $(NO_SIMD_LOGS),-- no-simd $(NO_SIMD_LOGS)) $(if $(OPENCL_LOGS),-- opencl $(OPENCL_LOGS)) \
	  $(if $(GROUP_LOGS),-- opencl-groups $(GROUP_LOGS)) $(if $(CHECKED_LOGS),-- checked $(CHECKED_LOGS))

test-build: $(addprefix $(TEST_DIR)/,$(sort $(PLAIN_TESTS) $(DEVICE_TESTS) $(CHECKED_TESTS) $(if $(CHECKED_TESTS),backend/emulator.so))) $(patsubst %/same_hashes,%/hashes,$(LIBRARY_TESTS:%=$(TEST_DIR)-no-simd/%))   ## build the tests (WITH_LIBRARIES=1 WITH_OPENCL=1)

test: TESTS ?= quick
# All groups at once where they can all be had; then nothing is missing of each.
test_groups = test examples display python opencl dicom maxflow $(if $(filter quick,$(TESTS)),,judges engines cohort slurm)
test:   ## build and run the tests, and those of each stage without SIMD and on OpenCL too
	@without="Going on without: the tests that want these are skipped."; \
	  $(DEPS) $(test_groups) || $(DEPS) test || exit 1; \
	  for group in $(filter-out test examples opencl,$(test_groups)); do $(DEPS) $$group || echo "$$without"; done; \
	  if $(DEPS) examples; then with=1; else with=0; echo "$$without"; fi; \
	  if $(DEPS) opencl; then opencl=1; else opencl=; echo "$$without"; fi; \
	  $(MAKE) $(PARALLEL) test-run TESTS=$(TESTS) WITH_LIBRARIES=$$with WITH_OPENCL=$$opencl

test-all:   ## all tests: every test without SIMD and on OpenCL too, those that take long, other programs as judges
	@$(MAKE) --no-print-directory test TESTS=all

test-rest:   ## the tests of test-all that are not in test
	@$(MAKE) --no-print-directory test TESTS=rest

# ---- sanitizers ----

# GCC's documentation: with sanitizers -Wmaybe-uninitialized gives false positives.
# Recipes say $(MAKE) themselves: make leaves a command that does not to one processor, whatever -j says.
SANITIZED = --no-print-directory test TESTS=$(or $(TESTS),all) VARIANT=$@ SANITIZE="-g1 -fno-omit-frame-pointer -Wno-maybe-uninitialized

asan:   ## the tests under AddressSanitizer and UndefinedBehaviorSanitizer (bounds, use after free, leaks, what C leaves open)
	@$(MAKE) $(SANITIZED) -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all"
tsan:   ## the tests with threads under ThreadSanitizer (data races; ALL=1: all of them)
	@$(MAKE) $(SANITIZED) -fsanitize=thread"

# MemorySanitizer does not follow vectors that are filled lane by lane: one lane is what it reads. Memory stays as malloc gives it,
# since what fills it would count as its first value.
msan: deps-oclgrind   ## the unit tests under MemorySanitizer (values that nobody has set)
	@$(MAKE) $(PARALLEL) test-run VARIANT=$@ CC=clang SANITIZE="-g1 -fno-omit-frame-pointer -fsanitize=memory -fno-sanitize-recover=all \
	  -DSPRINGLS_NO_SIMD -DTEST_MEMORY_UNFILLED"

lives: $(TEST_DIR)/unit/test_lives   ## random lives of models with new seeds, for MINUTES=30: calls and findings
	@LIVES_MINUTES=$(or $(MINUTES),30) $<

valgrind: deps-valgrind springls.h   ## models' lives under valgrind (memory that is lost, not set, or not theirs)
	@mkdir -p build
	$(SAY)$(CC) -std=c99 -O1 -g $(EXACT) -DTEST_MEMORY_UNFILLED -I. -Itests -o build/lives-valgrind tests/portability/hashes.c tests/library.c $(TEST_LIBS)
	valgrind --quiet --leak-check=full --show-leak-kinds=all --error-exitcode=1 build/lives-valgrind

# All tests, on the host and on OpenCL, and what the fuzzers have found worth keeping; tests that fail are left to `make test`.
cover-lines: deps-fuzz   ## how many lines of springls.h all tests reach, by part (clang, llvm-cov)
	@rm -rf build/cover && mkdir -p build/cover
	-@LLVM_PROFILE_FILE='$(CURDIR)/build/cover/%4m.profraw' $(MAKE) --no-print-directory test TESTS=all VARIANT=cover CC=clang CXX=clang++ \
	  SANITIZE="-fprofile-instr-generate -fcoverage-mapping" > build/cover/tests.log 2>&1
	@tests/cover_lines.sh

comma := ,
# libFuzzer's inputs are kept in build/fuzz/corpus, and go on from there the next time. Half of the time is without sanitizers.
FUZZ_BUILD = clang -std=c99 -O2 -g $(EXACT) -fno-sanitize-recover=all -I. -Itests -Iexamples -Iexamples/common $(NIFTI)
# Comparisons within the library are of computed numbers: to trace them halves the speed, and shows nothing about the input.
build/fuzz/library.o build/fuzz/library-plain.o: tests/library.c springls.h
	@mkdir -p build/fuzz
	$(SAY)$(FUZZ_BUILD) -fsanitize=fuzzer-no-link$(if $(filter %-plain.o,$@),,$(comma)address$(comma)undefined) -fno-sanitize-coverage=trace-cmp \
	  -c -o $@ $<
# The faces of libraries that are C++, with the sanitizers and without.
FUZZ_CXX = $(patsubst clang,clang++,$(filter-out -std=c99,$(FUZZ_BUILD))) -std=c++17 -fsanitize=fuzzer-no-link
# Looks at types of C++ want its runtime, which programs that are linked as C do not have.
NO_TYPES = -fno-sanitize=vptr
build/fuzz/objects/%-plain.o: examples/%.cpp
	@mkdir -p $(@D)
	$(SAY)$(FUZZ_CXX) -c -o $@ $<
build/fuzz/objects/%.o: examples/%.cpp
	@mkdir -p $(@D)
	$(SAY)$(FUZZ_CXX),address,undefined $(NO_TYPES) -c -o $@ $<
fuzz: deps-fuzz springls.h   ## random inputs for MINUTES=10 each, by libFuzzer (some: FUZZ="calls snapshot"); findings in build/fuzz
	@failed=0; $(foreach f,$(or $(FUZZ),$(FUZZERS)), \
	  { $(MAKE) --no-print-directory build/fuzz/$(f) build/fuzz/$(f)-plain && tests/fuzz/fuzz.sh $(f) $(or $(MINUTES),10); } || failed=1;) \
	  exit $$failed
# $(1): a fuzzer. $(2): -plain or nothing. $(3): its sanitizers.
define fuzz_build_rule
build/fuzz/$(1)$(2): tests/fuzz/fuzz_$(1).c $(filter-out %/implementation.c %.cpp,$(call folder_sources,$(fuzz_$(1)_USES))) build/fuzz/library$(2).o \
  $(patsubst examples/%.cpp,build/fuzz/objects/%$(2).o,$(filter %.cpp,$(call folder_sources,$(fuzz_$(1)_USES)))) $(wildcard tests/fuzz/*.h tests/fuzz/*.c)
	$$(SAY)$$(FUZZ_BUILD) -fsanitize=fuzzer$(3) -o $$@ $$< $$(filter examples/%.c %.o,$$^) $(call folder_libs,$(fuzz_$(1)_USES))
endef
$(foreach f,$(FUZZERS),$(eval $(call fuzz_build_rule,$(f),,$(comma)address$(comma)undefined))$(eval $(call fuzz_build_rule,$(f),-plain)))

oclgrind: deps-oclgrind springls.h   ## a tiny model on a simulated OpenCL device: memory errors, races, wrong calls
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -O2 -I. -Itests -DSPRINGLS_TEST_OPENCL -o build/opencl_small tests/backend/opencl_small.c tests/library.c $(TEST_LIBS)
	@tests/backend/oclgrind.sh build/opencl_small

# Without Rusticl that is skipped (77), which is no failure.
rusticl: deps-rusticl   ## kernels on Mesa's Rusticl, which divides in another way than C: results within a tolerance (GRIDS="32 64")
	@$(MAKE) --no-print-directory WITH_OPENCL=1 WITH_LIBRARIES=1 build/leveque build/test/backend/test_opencl_tolerance
	@tests/backend/rusticl.sh build/test/backend/test_opencl_tolerance build/leveque || [ $$? = 77 ]

device: deps-opencl   ## what the OpenCL device of this machine does, cold and cached, beside scalar code (PAGE=docs/gpu.md writes the page)
	@$(MAKE) --no-print-directory WITH_OPENCL=1 WITH_LIBRARIES=1 $(DEVICE_PROGRAMS)
	@tests/device/run.sh $(PAGE)

# Without clang and its libclc that is skipped (77), which is no failure.
gpu-text: deps-gpu-text   ## what compilers for GPUs make of each kernel: seconds, registers, stack, memory, within limits (clang, ptxas)
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -I. -o build/print_kernels tests/portability/print_kernels.c -lm
	@build/print_kernels > build/kernels.cl
	@tests/portability/gpu_text.sh build/kernels.cl || [ $$? = 77 ]

portability: deps-portability   ## the same bits from every compiler and platform at hand (PAGE=docs/platforms.md writes the page)
	@$(MAKE) --no-print-directory springls.h
	@tests/portability/platforms.sh $(PAGE)

# Where no such system can be made it says so (77), which is no failure.
fresh:   ## the targets GROUPS="demo test ..." that README names in a bare Debian each, with nothing installed (root, mmdebstrap)
	@tests/portability/fresh.sh $(or $(GROUPS),demo test examples python engines web npm packages) || [ $$? = 77 ]

web-test: web deps-web-test   ## the page in headless Chromium: mouse, touch, hashes; pictures of it in build/web/pictures
	@node tests/examples/web.js build/web/index.html build/web/pictures

packages: deps-packages   ## can programs find the library by CMake, Meson, pkg-config and the recipes of packages/? (ONLY=npm)
	@tests/portability/packages.sh $(ONLY)

compile-matrix: deps-matrix   ## both headers in every language, linkage and namespace mode, gcc and clang
	@$(MAKE) --no-print-directory springls.h build/embed
	@tests/portability/matrix.sh

-include $(wildcard build/test*/*.d build/test*/*/*.d build/test*/objects/*/*.d build/test*/objects/*/*/*.d)
