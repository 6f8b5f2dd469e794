# springls: what there is to build, test and measure. `make` alone lists it.
#
#   CC=clang CXX=clang++   other compilers        OPT=-O1   optimisation        CFLAGS=...   more flags
#   NATIVE=1               tune for this machine  V=1       print the commands
#   OPENMP=0 / OPENMP=1    threads by OpenMP: examples and benchmarks have them unless 0, tests only when 1
#   PARTS=1                tests read src/springls_parts.h, so that compiler messages name the part
#   SPRINGLS_DATA=folder   an optional collection of test data; without it the tests that want it are skipped
#   PREFIX, DESTDIR        for install

ifeq ($(origin CXX),default)
  CXX = g++
endif
# Only the name of what is built is printed; V=1 prints the commands.
SAY           = $(if $(V),,@echo "  $@";)
PREFIX       ?= /usr/local
WARNINGS      = -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow
# Results are the same bits for every compiler and level only while nobody fuses a*b+c. Without errno square roots
# vectorise; their bits stay the same.
EXACT         = -ffp-contract=off -fno-math-errno
STRICT        = -std=c99 $(WARNINGS) -Werror $(EXACT)
MACHINE       = $(if $(filter 1,$(NATIVE)),-march=native)
EXAMPLE_FLAGS = -std=c99 $(WARNINGS) $(EXAMPLE_STRICT) $(EXACT) $(or $(OPT),-O3) $(MACHINE) \
                $(if $(filter 0,$(OPENMP)),,-fopenmp) $(NIFTI) $(CFLAGS)
TEST_FLAGS    = $(STRICT) $(or $(OPT),-O2) -g $(MACHINE) $(if $(filter 1,$(OPENMP)),-fopenmp) \
                $(if $(filter 1,$(PARTS)),-DSPRINGLS_PARTS) $(if $(OPENCL),-DSPRINGLS_TEST_OPENCL) $(CFLAGS)
# Debian's NIfTI headers want their own folder in the search path.
NIFTI         = -isystem /usr/include/nifti
# Only what a program really uses is linked: --as-needed drops the rest. Examples may use POSIX besides C.
EXAMPLE_LIBS  = -Wl,--as-needed -lassimp -lnifti2 -lznz -lteem -lz -llapacke -lcjson -lglfw -lepoxy -lm -pthread
TEST_LIBS     = -lm -pthread

PARTS_FILES  := $(wildcard src/*.h src/*/*.h kernels_embed/*/*.h)
KERNEL_FILES := $(addprefix kernels_embed/device/,collectives.cl regions.cl entry_points.cl)
COMMON       := $(patsubst examples/common/%.c,build/common/%.o,$(wildcard examples/common/*.c))
# What of examples/common stands on the library; the rest of it knows nothing of springls.
ON_SPRINGLS  := $(filter-out %/segment_image.c,$(wildcard $(addprefix examples/common/,atlas*.c benchmark*.c model_*.c morph*.c run_options.c segment*.c track*.c viewer*.c)))
# What of that the atlas does without.
NOT_ATLAS    := $(filter-out $(addprefix examples/common/,atlas%.c run_options.c segment_model.c),$(ON_SPRINGLS))
EXAMPLES     := $(patsubst examples/%.c,build/%,$(wildcard examples/*.c)) $(patsubst examples/%.cpp,build/%,$(wildcard examples/*.cpp))
# Tests have OpenCL where its headers are; the parts have no text for it.
OPENCL       := $(if $(filter 1,$(PARTS)),,$(filter 1,$(WITH_OPENCL)))
# Sanitized tests and tests of the parts live in folders of their own, beside the plain ones.
TEST_DIR     := build/test$(addprefix -,$(VARIANT))$(if $(filter 1,$(PARTS)),-parts)
# Where there is one thread there are no races: ThreadSanitizer looks at the tests that start some.
TEST_FILES   := $(filter-out tests/test_opencl_%,$(if $(filter tsan,$(VARIANT)),$(shell grep -l -e pthread -e histories.h tests/test_*.c),$(sort $(wildcard tests/test_*.c))))
TESTS        := $(patsubst tests/%.c,$(TEST_DIR)/%,$(TEST_FILES))

ifdef SPRINGLS_DATA
  export SPRINGLS_DATA
endif
# Threads that wait in a busy loop take the processor from those that work, wherever the machine has something else to do.
export OMP_WAIT_POLICY ?= passive

.PHONY: help deps deps-demo deps-display deps-test deps-opencl deps-bench check examples demo test test-run bench paper ablation motions \
        segmentation imaging install format clean \
        asan ubsan tsan msan oclgrind deps-oclgrind compile-matrix deps-matrix FORCE
.DELETE_ON_ERROR:

help:   ## this list
	@sed -n 's/^\([a-z.-]*\):.*## */\1\t/p' Makefile | expand -t 18

# ---- set-up: finds what is missing and installs it, saying so ----

deps: deps-test deps-demo deps-display deps-opencl   ## install what demo and test need, where missing

DEPS = CC="$(CC)" CXX="$(CXX)" HEAD_SCAN="$(HEAD_SCAN)" .ci/deps.sh

deps-demo deps-display deps-test deps-opencl deps-oclgrind deps-bench deps-matrix:
	@$(DEPS) $(@:deps-%=%)

# ---- the product ----

build/embed: kernels_embed/embed.c
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -O1 -o $@ $<

springls.h: build/embed $(PARTS_FILES) $(KERNEL_FILES)   ## put the parts together again, if one has changed
	build/embed src/springls_parts.h $(KERNEL_FILES) > build/springls.h.new
	mv build/springls.h.new $@

# springls.h is no prerequisite: what is checked is the file as it is, not as make would refresh it.
check: build/embed   ## is springls.h what the parts produce? is its OpenCL text clean?
	@build/embed src/springls_parts.h $(KERNEL_FILES) > build/springls.h.check
	@cmp -s springls.h build/springls.h.check || { \
	  echo "check: springls.h is not what src/ and kernels_embed/ produce: run 'make springls.h' and commit it;"; \
	  echo "       if it was edited by hand, put that change into the part first. First difference:"; \
	  diff springls.h build/springls.h.check | head -n 5; exit 1; }
	@$(CC) $(STRICT) -I. -o build/print_kernels tests/compile/print_kernels.c -lm
	@build/print_kernels > build/kernels.cl
	@tests/compile/kernels.sh build/kernels.cl

SETTINGS = $(CC) $(CXX) $(OPT) $(NATIVE) $(OPENMP) $(CFLAGS) $(WITH_LIBRARIES) $(WITH_OPENCL)
# What a folder was built with. A change of it, say CC=clang or OPENMP=0, builds everything there again.
.PRECIOUS: %/settings
%/settings: FORCE
	@mkdir -p $(@D)
	@echo '$(SETTINGS)' | cmp -s - $@ || echo '$(SETTINGS)' > $@

# ---- examples ----

build/common/%.o: examples/common/%.c build/common/settings | springls.h
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -I. -MMD -MP -c -o $@ $<

build/libcommon.a: $(COMMON)
	@rm -f $@
	$(SAY)$(AR) rcs $@ $(COMMON)

build/%: examples/%.c springls.h springls_cl.h build/libcommon.a build/common/settings
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -I. -MMD -MP -MF build/$*.d -o $@ $< build/libcommon.a $(EXAMPLE_LIBS)

# C++17, as engines are written.
build/%: examples/%.cpp springls.h build/common/settings
	$(SAY)$(CXX) $(filter-out -std=c99,$(EXAMPLE_FLAGS)) -std=c++17 -I. -MMD -MP -MF build/$*.d -o $@ $< -lm -pthread

examples: $(EXAMPLES)   ## build every program of examples/ into build/

HEAD_SCAN  ?= /usr/share/mricron/templates/ch2bet.nii.gz
# Between fluid and grey matter of that scan.
HEAD_LEVEL ?= 72

demo: deps-demo   ## from nothing to results: set-up, build, two programs run into build/demo/
	@$(MAKE) --no-print-directory examples
	@mkdir -p build/demo
	build/leveque --grid 64 --period 1.25 --out build/demo
	build/segment $(HEAD_SCAN) --level $(HEAD_LEVEL) --out build/demo/brain
	@echo "see build/demo/"

# ---- tests ----

# Tests of examples/common are compiled together with it, so that the sanitizers see its code too; that of the atlas
# holds the library for all its files. Where its libraries
# cannot be had these tests skip themselves.
ifeq ($(WITH_LIBRARIES),1)
$(TEST_DIR)/test_examples_%: tests/test_examples_%.c springls.h springls_cl.h $(TEST_DIR)/settings $(wildcard examples/common/*.[ch])
	$(SAY)$(CC) $(TEST_FLAGS) $(SANITIZE) $(NIFTI) -I. -Itests -DTEST_EXAMPLES_COMMON -o $@ $< \
	  $(filter-out $(if $(findstring test_examples_atlas,$@),$(NOT_ATLAS),$(ON_SPRINGLS)),$(wildcard examples/common/*.c)) \
	  $(EXAMPLE_LIBS)
endif

$(TEST_DIR)/%: tests/%.c springls.h $(TEST_DIR)/settings
	$(SAY)$(CC) $(TEST_FLAGS) $(SANITIZE) -I. -Itests -MMD -MP -MF $@.d -o $@ $< $(TEST_LIBS)

# The engine's game loop, and the code of docs/engine.md, as a C++ program of their own; with threads, so under every sanitizer.
TESTS += $(TEST_DIR)/test_engine
$(TEST_DIR)/test_engine: tests/test_engine.cc examples/engine_embed.cpp docs/engine.md springls.h $(TEST_DIR)/settings
	@sed -n '/^```cpp/,/^```$$/{/^```/!p}' docs/engine.md > $(TEST_DIR)/engine_sample.h
	$(SAY)$(CXX) $(filter-out -std=c99,$(TEST_FLAGS)) -std=c++17 $(SANITIZE) -I. -Itests -I$(TEST_DIR) -MMD -MP -MF $@.d -o $@ $< $(TEST_LIBS)

test: deps-test   ## build and run tests/test_*.c, each a program of its own, on both backends
	@without="Going on without: the tests that want these are skipped."; \
	  if $(DEPS) demo; then with=1; else with=0; echo "$$without"; fi; \
	  $(DEPS) display || echo "$$without"; \
	  if $(DEPS) opencl; then opencl=1; else opencl=0; echo "$$without"; fi; \
	  $(MAKE) --no-print-directory test-run WITH_LIBRARIES=$$with WITH_OPENCL=$$opencl

# Beside another library, where that is installed. Its own memory handling would occupy the sanitizers.
ifneq ($(VARIANT),)
else ifneq ($(wildcard /usr/include/openvdb/openvdb.h),)
TESTS += $(TEST_DIR)/test_openvdb
$(TEST_DIR)/test_openvdb: tests/test_openvdb.cc springls.h $(TEST_DIR)/settings
	$(SAY)$(CXX) -std=c++17 $(EXACT) -O1 -I. -Itests -MMD -MP -MF $@.d -o $@ $< -Wl,--copy-dt-needed-entries -lopenvdb -ltbb $(TEST_LIBS)
endif

# The library's tests run a second time, with their contexts on OpenCL, beside those that are about OpenCL. Under a sanitizer
# they do not: what a driver does with memory and threads is its own affair.
OPENCL_FILES  := $(if $(OPENCL),$(wildcard tests/test_opencl_*.c))
WITH_CONTEXTS := $(filter-out tests/test_examples_% tests/test_opencl_%,$(shell grep -l -E 'fixture_(context|desc|sphere|box|torus)|histories' tests/test_*.c))
DEVICE_TESTS  := $(if $(VARIANT)$(filter 1,$(PARTS)),,$(patsubst tests/%.c,$(TEST_DIR)/%,$(WITH_CONTEXTS) $(OPENCL_FILES)))

# A library that stands before OpenCL's and fails on demand.
$(TEST_DIR)/opencl_stub.so: tests/opencl_stub.c tests/opencl_stub.h $(TEST_DIR)/settings
	$(SAY)$(CC) $(TEST_FLAGS) -shared -fPIC -o $@ $<
$(TEST_DIR)/test_opencl_faults: | $(TEST_DIR)/opencl_stub.so

test-run: $(TESTS) $(DEVICE_TESTS)
	@tests/run.sh $(TESTS) $(if $(DEVICE_TESTS),--opencl $(DEVICE_TESTS))

# GCC's documentation: with sanitizers -Wmaybe-uninitialized gives false positives.
SANITIZED = $(MAKE) --no-print-directory test VARIANT=$@ OPT=-O1 SANITIZE="-fno-omit-frame-pointer -Wno-maybe-uninitialized

asan:   ## the tests under AddressSanitizer (out-of-bounds, use after free, leaks)
	@$(SANITIZED) -fsanitize=address"
ubsan:  ## the tests under UndefinedBehaviorSanitizer
	@$(SANITIZED) -fsanitize=undefined,float-cast-overflow -fno-sanitize-recover=all"
tsan:   ## the tests with threads under ThreadSanitizer (data races)
	@$(SANITIZED) -fsanitize=thread"

# Vectors that are filled lane by lane it does not follow: the scalar text is what it reads.
msan: deps-oclgrind springls.h   ## models' lives under MemorySanitizer (values that nobody has set)
	@mkdir -p build
	$(SAY)clang -std=c99 -O1 -g $(EXACT) -fsanitize=memory -fno-sanitize-recover=all -DSPRINGLS_NO_SIMD -I. -Itests -o build/lives-msan \
	  tests/compile/hashes.c $(TEST_LIBS)
	build/lives-msan

oclgrind: deps-oclgrind springls.h   ## a tiny model on a simulated OpenCL device: memory errors, races, wrong calls
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -O2 -I. -Itests -o build/opencl_small tests/opencl_small.c $(TEST_LIBS)
	@tests/oclgrind.sh build/opencl_small

compile-matrix: deps-matrix   ## both headers in every language, linkage and namespace mode, gcc and clang
	@$(MAKE) --no-print-directory springls.h build/embed
	@tests/compile/matrix.sh

# ---- measurements ----

# bench and paper start the example programs and these, and read what they print; ablation and motions run the library
# themselves, by motion.c. All share tests/bench/{runs,table}.c.
BENCH_SHARED  := tests/bench/runs.c tests/bench/table.c
BENCH_HEADERS := $(wildcard tests/bench/*.h examples/common/*.h)

build/bench/bench build/bench/paper build/bench/ablation build/bench/motions build/bench/segmentation build/bench/imaging: build/bench/%: $(BENCH_SHARED) $(BENCH_HEADERS) build/libcommon.a build/bench/settings
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -I. -o $@ $(filter %.c,$^) build/libcommon.a $(EXAMPLE_LIBS)
build/bench/bench: tests/bench/bench.c
build/bench/segmentation: tests/bench/segmentation.c
build/bench/imaging: $(wildcard tests/bench/imaging*.c)
build/bench/paper: $(wildcard tests/bench/paper*.c) springls.h
build/bench/ablation build/bench/motions: build/bench/%: tests/bench/%.c tests/bench/motion.c springls.h

build/bench/%: tests/bench/%.c springls.h build/libcommon.a build/bench/settings
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -I. -MMD -MP -MF $@.d -o $@ $< build/libcommon.a $(EXAMPLE_LIBS)

# OpenVDB's headers use functions of libraries that it links itself; hence the linker's option.
build/bench/%: tests/bench/%.cc springls.h build/libcommon.a build/bench/settings
	$(SAY)$(CXX) -std=c++17 -O3 $(EXACT) $(MACHINE) -fopenmp -I. -MMD -MP -MF $@.d -o $@ $< build/libcommon.a \
	  -Wl,--copy-dt-needed-entries $(EXAMPLE_LIBS) -lopenvdb -ltbb

BENCH_PROGRAMS := build/leveque build/zalesak build/morph $(addprefix build/bench/,bench memory frames openvdb_advection)
PAPER_PROGRAMS := build/leveque build/zalesak $(addprefix build/bench/,paper turns)

bench: deps-bench   ## beside OpenVDB: time, errors, memory, threads, OpenCL, compile time, frames (GRID=128; ONLY=opencl, ONLY=frames)
	@$(MAKE) --no-print-directory $(BENCH_PROGRAMS)
	@CC="$(CC)" build/bench/bench

paper: deps-demo   ## the paper's tables and figures from our runs (some: PAPER="table3 fig14"; FULL=1; KEEP=1)
	@$(MAKE) --no-print-directory $(PAPER_PROGRAMS)
	@build/bench/paper $(if $(filter 1,$(FULL)),--full) $(if $(filter 1,$(KEEP)),--keep) $(PAPER)

ablation: deps-demo   ## what each improvement over the paper is worth on LeVeque's test (GRID=64 PERIOD=2 ORDERS=3)
	@$(MAKE) --no-print-directory build/bench/ablation
	@build/bench/ablation

motions: deps-demo   ## the default parameters on motions with known answers (GRID=128 STEP=2 ORDERS=3)
	@$(MAKE) --no-print-directory build/bench/motions
	@build/bench/motions

segmentation: deps-demo   ## the paper's Table 6 on the images of SPRINGLS_DATA (some: ROWS="hip chest")
	@$(MAKE) --no-print-directory build/segment build/bench/segmentation
	@build/bench/segmentation $(ROWS)

IMAGING_PROGRAMS := $(addprefix build/,segment register track4d atlas bench/prepare bench/imaging)
quoted = $(if $(2),--$(1) '$(subst ','\'',$(2))')

imaging: deps-demo   ## the imaging programs from end to end: one page (SPRINGLS_DATA; or IMAGE= LABELS= SERIES= ..., see docs/imaging.md)
	@$(MAKE) --no-print-directory $(IMAGING_PROGRAMS)
	@$(if $(filter 1,$(KEEP)),,rm -rf build/imaging)
	@build/bench/imaging --templates $(patsubst %/,%,$(dir $(HEAD_SCAN))) $(call quoted,image,$(IMAGE)) $(call quoted,level,$(LEVEL)) \
	  $(call quoted,labels,$(LABELS)) $(call quoted,label,$(LABEL)) $(call quoted,series,$(SERIES)) \
	  $(call quoted,series-labels,$(SERIES_LABELS)) $(call quoted,landmarks,$(LANDMARKS)) $(call quoted,subjects,$(SUBJECTS)) \
	  $(call quoted,backend,$(BACKEND)) $(if $(filter 1,$(KEEP)),--keep)

# ---- the rest ----

install: springls.h   ## copy the headers to $(DESTDIR)$(PREFIX)/include
	install -d $(DESTDIR)$(PREFIX)/include
	install -m 644 springls.h springls_cl.h $(DESTDIR)$(PREFIX)/include

format:   ## lay out FILES="..." as .clang-format says (an aid: formulas are better laid out by hand)
	$(if $(FILES),clang-format -i $(FILES),@echo 'which? make format FILES="src/new.h"'; exit 2)

clean:   ## remove build/
	rm -rf build

-include $(wildcard build/*.d build/common/*.d build/test*/*.d build/bench/*.d)
