# ---- tests ----

# Tests of the examples are compiled together with the folders that they use (examples/examples.mk), so that the sanitizers
# see their code too. Where the libraries of these folders cannot be had the tests skip themselves.
ifeq ($(WITH_LIBRARIES),1)
test_atlas_USES     = $(atlas_USES)
test_bad_files_USES = surface imaging
test_common_USES    = surface imaging
test_contour_USES   = $(segment_USES)
test_imaging_USES   = base
test_morph_USES     = $(morph_USES)
test_register_USES  = $(registration_USES) registration
test_segment_USES   = imaging
test_track_USES     = $(track4d_USES)
test_viewer_USES    = $(viewer_USES)
test_volume_USES    = imaging
test_atlas_LIBS     = $(atlas_LIBS)
test_imaging_LIBS   = -lcjson
test_morph_LIBS     = $(morph_LIBS)
test_viewer_LIBS    = $(viewer_LIBS)
# The other program tests include the sources of their program.
test_atlas_SOURCES  = $(filter-out examples/atlas/atlas.c,$(wildcard examples/atlas/*.c))

$(TEST_DIR)/examples/test_%: tests/examples/test_%.c springls.h springls_cl.h $(TEST_DIR)/settings $(wildcard examples/*.c examples/*/*.[ch] examples/common/*/*.[ch])
	@mkdir -p $(@D)
	$(SAY)$(CC) $(TEST_FLAGS) $(SANITIZE) $(NIFTI) -I. -Itests -Iexamples -Iexamples/common -DTEST_EXAMPLES_COMMON -o $@ $< \
	  $($(@F)_SOURCES) $(call folder_sources,$($(@F)_USES)) $($(@F)_LIBS) $(call folder_libs,$($(@F)_USES))
endif

$(TEST_DIR)/%: tests/%.c springls.h $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CC) $(TEST_FLAGS) $(SANITIZE) -I. -Itests -MMD -MP -MF $@.d -o $@ $< $(TEST_LIBS)

# The engine's game loop, and the code of docs/engine.md, as a C++ program of their own; with threads, so under every sanitizer.
TESTS += $(TEST_DIR)/examples/test_engine
$(TEST_DIR)/examples/test_engine: tests/examples/test_engine.cc examples/engine_embed.cpp docs/engine.md springls.h $(TEST_DIR)/settings
	@mkdir -p $(@D)
	@sed -n '/^```cpp/,/^```$$/{/^```/!p}' docs/engine.md > $(TEST_DIR)/engine_sample.h
	$(SAY)$(CXX) $(filter-out -std=c99,$(TEST_FLAGS)) -std=c++17 $(SANITIZE) -I. -Itests -I$(TEST_DIR) -MMD -MP -MF $@.d -o $@ $< $(TEST_LIBS)

test: deps-test   ## build and run tests/*/test_*.c, each a program of its own, on both backends
	@without="Going on without: the tests that want these are skipped."; \
	  if $(DEPS) examples; then with=1; else with=0; echo "$$without"; fi; \
	  $(DEPS) display || echo "$$without"; \
	  if $(DEPS) opencl; then opencl=1; else opencl=0; echo "$$without"; fi; \
	  $(MAKE) --no-print-directory test-run WITH_LIBRARIES=$$with WITH_OPENCL=$$opencl

# Beside another library, where that is installed. Its own memory handling would occupy the sanitizers.
ifneq ($(VARIANT),)
else ifneq ($(wildcard /usr/include/openvdb/openvdb.h),)
TESTS += $(TEST_DIR)/unit/test_openvdb
$(TEST_DIR)/unit/test_openvdb: tests/unit/test_openvdb.cc springls.h $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CXX) -std=c++17 $(EXACT) -O1 -I. -Itests -MMD -MP -MF $@.d -o $@ $< -Wl,--copy-dt-needed-entries -lopenvdb -ltbb $(TEST_LIBS)
endif

# The library's tests run a second time, with their contexts on OpenCL, beside those that are about OpenCL. Under a sanitizer
# they do not: what a driver does with memory and threads is its own affair.
OPENCL_FILES  := $(if $(OPENCL),$(wildcard tests/backend/test_opencl_*.c))
WITH_CONTEXTS := $(shell grep -l -E 'fixture_(context|desc|sphere|box|torus)|histories' tests/unit/test_*.c)
DEVICE_TESTS  := $(if $(VARIANT)$(filter 1,$(PARTS)),,$(patsubst tests/%.c,$(TEST_DIR)/%,$(WITH_CONTEXTS) $(OPENCL_FILES)))

# A library that stands before OpenCL's and fails on demand.
$(TEST_DIR)/backend/opencl_stub.so: tests/backend/opencl_stub.c tests/backend/opencl_stub.h $(TEST_DIR)/settings
	@mkdir -p $(@D)
	$(SAY)$(CC) $(TEST_FLAGS) -shared -fPIC -o $@ $<
$(TEST_DIR)/backend/test_opencl_faults: | $(TEST_DIR)/backend/opencl_stub.so

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
	  tests/portability/hashes.c $(TEST_LIBS)
	build/lives-msan

oclgrind: deps-oclgrind springls.h   ## a tiny model on a simulated OpenCL device: memory errors, races, wrong calls
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -O2 -I. -Itests -o build/opencl_small tests/backend/opencl_small.c $(TEST_LIBS)
	@tests/backend/oclgrind.sh build/opencl_small

compile-matrix: deps-matrix   ## both headers in every language, linkage and namespace mode, gcc and clang
	@$(MAKE) --no-print-directory springls.h build/embed
	@tests/portability/matrix.sh
