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
