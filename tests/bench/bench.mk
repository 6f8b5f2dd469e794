# ---- measurements ----

# bench and paper start the example programs and these, and read what they print; ablation and motions run the library
# themselves, by motion.c. All share tests/bench/{runs,table}.c.
BENCH_SHARED  := tests/bench/runs.c tests/bench/table.c
BENCH_HEADERS := $(wildcard tests/bench/*.h)
BENCH_FLAGS    = -I. -Iexamples -Iexamples/common

# The folders of examples/common that each uses (see examples/examples.mk).
bench_bench_USES        = base
bench_segmentation_USES = base
bench_imaging_USES      = pictures
bench_registration_USES = imaging
bench_variations_USES   = imaging
bench_paper_USES        = springls imaging
bench_ablation_USES     = springls surface
bench_accuracy_USES     = springls surface
bench_motions_USES      = springls surface
bench_edits_USES        = springls
bench_flight_USES       = springls
bench_frames_USES       = springls
bench_memory_USES       = springls
bench_queries_USES      = springls
bench_tilings_USES      = springls
bench_turns_USES        = springls
bench_prepare_USES      = imaging
bench_vtk_to_nifti_USES = imaging
bench_solids_USES       = surface
bench_imaging_LIBS      = -lcjson

# Several sources: $(1) the program, $(2) the sources.
define bench_rule
build/bench/$(1): $(2) $(BENCH_SHARED) $(BENCH_HEADERS) $(call folder_archives,$(bench_$(1)_USES)) build/bench/settings | springls.h
	$$(SAY)$$(CC) $$(EXAMPLE_FLAGS) $$(BENCH_FLAGS) -o $$@ $$(filter %.c %.a,$$^) $(bench_$(1)_LIBS) $(call folder_libs,$(bench_$(1)_USES))
endef
$(eval $(call bench_rule,bench,tests/bench/bench.c))
$(eval $(call bench_rule,segmentation,tests/bench/segmentation.c))
$(eval $(call bench_rule,registration,tests/bench/registration.c tests/examples/elastix_parameters.h))
$(eval $(call bench_rule,variations,tests/bench/variations.c tests/examples/elastix_parameters.h))
$(eval $(call bench_rule,imaging,$(wildcard tests/bench/imaging*.c)))
$(eval $(call bench_rule,paper,$(wildcard tests/bench/paper*.c)))
$(eval $(call bench_rule,solids,$(wildcard tests/bench/solids*.c) tests/mesh_damage.h))
$(eval $(call bench_rule,ablation,tests/bench/ablation.c tests/bench/motion.c))
$(eval $(call bench_rule,accuracy,tests/bench/accuracy.c tests/bench/known_motions.c tests/bench/motion.c))
$(eval $(call bench_rule,motions,tests/bench/motions.c tests/bench/known_motions.c tests/bench/motion.c))

# One source; the last one is C++, and uses functions of libraries that OpenVDB links itself: hence the linker's option.
define bench_file_rule
build/bench/$(1): tests/bench/$(1).c $(call folder_archives,$(bench_$(1)_USES)) build/bench/settings | springls.h
	$$(SAY)$$(CC) $$(EXAMPLE_FLAGS) $$(BENCH_FLAGS) -MMD -MP -MF $$@.d -o $$@ $$(filter %.c %.a,$$^) $(call folder_libs,$(bench_$(1)_USES))
endef
BENCH_FILES := edits flight frames memory queries tilings turns prepare vtk_to_nifti
$(foreach p,$(BENCH_FILES),$(eval $(call bench_file_rule,$(p))))

build/bench/openvdb_advection: tests/bench/openvdb_advection.cc $(call folder_archives,base) build/bench/settings | springls.h
	$(SAY)$(CXX) -std=c++17 -O3 $(EXACT) $(MACHINE) $(THREADS) $(BENCH_FLAGS) -MMD -MP -MF $@.d -o $@ $(filter %.cc %.a,$^) \
	  -Wl,--copy-dt-needed-entries $(call folder_libs,base) -lopenvdb -ltbb

# Others that mend, each where its packages are.
build/bench/solids_openvdb: tests/bench/solids_openvdb.cc $(call folder_archives,surface) build/bench/settings
	$(SAY)$(CXX) -std=c++17 -O3 $(MACHINE) $(BENCH_FLAGS) -MMD -MP -MF $@.d -o $@ $(filter %.cc %.a,$^) \
	  -Wl,--copy-dt-needed-entries $(call folder_libs,surface) -lopenvdb -ltbb
build/bench/solids_cgal: tests/bench/solids_cgal.cc build/bench/settings
	$(SAY)$(CXX) -std=c++17 -O3 -frounding-math $(MACHINE) -MMD -MP -MF $@.d -o $@ $(filter %.cc,$^) -lgmp -lmpfr
SOLIDS_PROGRAMS = build/mend build/bench/solids $(if $(wildcard /usr/include/openvdb/openvdb.h),build/bench/solids_openvdb) \
                  $(if $(wildcard /usr/include/CGAL/alpha_wrap_3.h),build/bench/solids_cgal)

# With OpenVDB's rows where it is installed.
build/bench/surface: tests/bench/surface.cc $(call folder_archives,pictures) build/bench/settings | springls.h
	$(SAY)$(CXX) -std=c++17 -O3 $(EXACT) $(MACHINE) $(BENCH_FLAGS) -MMD -MP -MF $@.d -o $@ $(filter %.cc %.a,$^) \
	  -Wl,--copy-dt-needed-entries $(call folder_libs,pictures) $(if $(wildcard /usr/include/openvdb/openvdb.h),-lopenvdb -ltbb)

# A model from a mesh; the same.
build/bench/set_mesh: tests/bench/set_mesh.cc $(call folder_archives,surface) build/bench/settings | springls.h
	$(SAY)$(CXX) -std=c++17 -O3 $(EXACT) $(MACHINE) $(BENCH_FLAGS) -MMD -MP -MF $@.d -o $@ $(filter %.cc %.a,$^) \
	  -Wl,--copy-dt-needed-entries $(call folder_libs,surface) $(if $(wildcard /usr/include/openvdb/openvdb.h),-lopenvdb -ltbb)

BENCH_PROGRAMS := $(addprefix build/,leveque zalesak morph segment) $(addprefix build/bench/,bench memory frames queries openvdb_advection)
# OpenVDB's rows are left out where it is not installed.
PAPER_PROGRAMS  = build/leveque build/zalesak build/morph $(IMAGING_PROGRAMS) $(addprefix build/bench/,paper turns segmentation $(if $(wildcard /usr/include/openvdb/openvdb.h),openvdb_advection))

measurements: deps-examples   ## build every program that measures
	@$(MAKE) --no-print-directory $(addprefix build/bench/,bench segmentation registration imaging paper ablation accuracy motions solids surface set_mesh $(BENCH_FILES) \
	  $(if $(wildcard /usr/include/openvdb/openvdb.h),openvdb_advection))

bench: deps-bench   ## beside OpenVDB: time, errors, memory, threads, OpenCL, compile time, frames, segment, queries (GRID=128; FULL=1; ONLY=opencl, =frames, =queries, =flight, =edits)
	@$(MAKE) --no-print-directory $(if $(filter flight edits,$(ONLY)),build/bench/$(ONLY),$(BENCH_PROGRAMS))
	@$(if $(filter flight edits,$(ONLY)),build/bench/$(ONLY) $(or $(GRID),$(if $(filter flight,$(ONLY)),512,128)),CC="$(CC)" HEAD_SCAN='$(HEAD_SCAN)' HEAD_LEVEL='$(HEAD_LEVEL)' build/bench/bench)

build/bench/leveque_openmp: examples/leveque.c $(call folder_sources,$(leveque_USES)) build/bench/settings | springls.h
	$(SAY)$(CC) $(EXAMPLE_FLAGS) -fopenmp -I. -Iexamples -Iexamples/common -o $@ $(filter %.c,$^) $(call folder_libs,$(leveque_USES))

busy: deps-examples   ## LeVeque's test beside LOADS=8 busy loops, by the pool of threads and by OpenMP (GRID=64 ROUNDS=5; LOADS=0; SPIN=0)
	@$(MAKE) --no-print-directory build/leveque build/bench/leveque_openmp
	@tests/bench/busy.sh

paper:   ## docs/results.md: the paper's tables and figures, theirs and ours (PAPER=help; PAPER="table3 fig14"; FULL=1; KEEP=1; JOBS=1)
	@$(DEPS) examples scan
	@$(MAKE) --no-print-directory $(if $(filter help page,$(PAPER)),build/bench/paper,$(PAPER_PROGRAMS))
	@build/bench/paper $(if $(filter 1,$(FULL)),--full) $(if $(filter 1,$(KEEP)),--keep) $(if $(JOBS),--jobs $(JOBS)) $(PAPER)

surface: deps-examples   ## docs/surface.md: the watertight surface of known shapes, beside OpenVDB's volumeToMesh where that is installed (PAGE= PICTURE=)
	@$(MAKE) --no-print-directory build/bench/surface
	@build/bench/surface $(or $(PAGE),docs/surface.md) $(or $(PICTURE),docs/pictures/surface.png)

set-mesh: deps-examples   ## seconds to set models from meshes and to extract them, beside OpenVDB where that is installed (MESHES="A.obj B.ply" GRID=128)
	@$(MAKE) --no-print-directory build/bench/set_mesh
	@build/bench/set_mesh $(or $(GRID),128) $(or $(MESHES),$(wildcard $(SPRINGLS_DATA)/meshes/*.obj $(SPRINGLS_DATA)/meshes/*.off))

ablation: deps-examples   ## what each improvement over the paper is worth on LeVeque's test (GRID=64 PERIOD=2 ORDERS=3)
	@$(MAKE) --no-print-directory build/bench/ablation
	@build/bench/ablation

tilings: deps-examples   ## many bodies in one space: walls in a flow beside exact ones, cost, octants, wedges, pressure, double bubbles, balls that meet (PAGE=docs/tilings.md; or ONLY=cells, printed; FULL=1: 1,000 balls too)
	@$(MAKE) --no-print-directory build/bench/tilings
	@build/bench/tilings $(PAGE)

motions: deps-examples   ## the default parameters on motions with known answers (GRID=128 STEP=2 ORDERS=3)
	@$(MAKE) --no-print-directory build/bench/motions
	@build/bench/motions

morph-pairs: deps-examples   ## every character of CHARACTERS=DIR becomes every other one (GRID=96): the table of docs/morph.md
	@$(MAKE) --no-print-directory build/morph
	@tests/bench/morph_pairs.py $(or $(CHARACTERS),$(SPRINGLS_DATA)/rigged) build/bench/morph_pairs --grid $(or $(GRID),96) \
	    -- --frames 40 --blend 24

rigs: deps-examples   ## rig beside the artists' joints of CHARACTERS=DIR (FETCH=1: characters of Debian's packages too, 1.4 GB)
	@$(MAKE) --no-print-directory build/rig >&2
	@mkdir -p build/bench/characters
	@cp -u $(or $(CHARACTERS),$(SPRINGLS_DATA)/rigged)/*.glb build/bench/characters
	@$(if $(FETCH),tests/bench/rigs.py --fetch build/bench/characters)
	@tests/bench/rigs.py build/bench/characters build/bench/rigs --plot build/bench/rigs/confidence.svg

coverage:   ## how well springls cover the surface: leveque, zalesak, segment's brain, motions (FULL=1: 256^3 too; ORDERS=3)
	@$(DEPS) examples scan
	@$(MAKE) --no-print-directory build/leveque build/zalesak build/segment build/bench/bench build/bench/motions
	@ONLY=cover HEAD_SCAN='$(HEAD_SCAN)' HEAD_LEVEL='$(HEAD_LEVEL)' build/bench/bench
	@ONLY=cover build/bench/motions

accuracy: deps-examples   ## is the library as accurate as the documentation promises? motions with known answers, both parameter sets
	@$(MAKE) --no-print-directory build/bench/accuracy
	@build/bench/accuracy

LONG_TESTS = build/long/unit/test_long build/long/unit/test_self_intersections
long: deps-test springls.h   ## a flow for LONG_STEPS=100000, LONG_EDITS=10000 edits: memory, volume, specks, bits; crossing triangles by CGAL
	@$(MAKE) --no-print-directory $(LONG_TESTS) TEST_DIR=build/long OPT=-O3
	@LONG_STEPS=$(or $(LONG_STEPS),100000) LONG_EDITS=$(or $(LONG_EDITS),10000) build/long/unit/test_long -v
	@LONG_STEPS=$(or $(LONG_STEPS),1000) LONG_EDITS=$(or $(LONG_EDITS),1000) build/long/unit/test_self_intersections -v

segmentation: deps-examples   ## the paper's Table 6 on the images of SPRINGLS_DATA (some: ROWS="hip chest")
	@$(MAKE) --no-print-directory build/segment build/bench/segmentation
	@build/bench/segmentation $(ROWS)

registration: deps-elastix   ## register beside elastix and plastimatch, on a beating heart with exact landmarks, and eleven variations of it (ONLY=motion, variations)
	@test '$(ONLY)' = motion || $(DEPS) plastimatch || echo "Going on without: its columns are empty."
	@$(MAKE) --no-print-directory build/register build/bench/registration build/bench/variations
	@test '$(ONLY)' = variations || build/bench/registration
	@test '$(ONLY)' = motion || build/bench/variations

solids:   ## 210 damaged solids mended by mend, CGAL and OpenVDB; with SPRINGLS_DATA 420 (SOLIDS=30; KEEP=1; ALONE=1; PAGE=docs/solids.md)
	@$(DEPS) examples; $(DEPS) openvdb cgal || echo "Going on without: their rows are left out."
	@$(MAKE) --no-print-directory $(SOLIDS_PROGRAMS)
	@build/bench/solids $(if $(SOLIDS),--solids $(SOLIDS)) $(if $(filter 1,$(KEEP)),--keep) $(if $(filter 1,$(ALONE)),--alone) \
	  $(if $(PAGE),--page $(PAGE) --picture $(dir $(PAGE))pictures/solids.png)

IMAGING_PROGRAMS := $(addprefix build/,segment register track4d atlas bench/prepare bench/imaging)
quoted = $(if $(2),--$(1) '$(subst ','\'',$(2))')

imaging:   ## the imaging programs from end to end: one page (SPRINGLS_DATA; or IMAGE= LABELS= SERIES= ..., see docs/imaging.md)
	@$(DEPS) examples scan maxflow
	@$(MAKE) --no-print-directory $(IMAGING_PROGRAMS)
	@$(if $(filter 1,$(KEEP)),,rm -rf build/imaging)
	@build/bench/imaging --templates $(patsubst %/,%,$(dir $(HEAD_SCAN))) $(call quoted,image,$(IMAGE)) $(call quoted,level,$(LEVEL)) \
	  $(call quoted,labels,$(LABELS)) $(call quoted,label,$(LABEL)) $(call quoted,series,$(SERIES)) \
	  $(call quoted,series-labels,$(SERIES_LABELS)) $(call quoted,landmarks,$(LANDMARKS)) $(call quoted,subjects,$(SUBJECTS)) \
	  $(call quoted,backend,$(BACKEND)) $(call quoted,page,$(PAGE)) $(if $(filter 1,$(KEEP)),--keep)

# Programs whose library has its tuned constants from the environment: only its one file is compiled again.
CONSTANTS_PROGRAMS := leveque zalesak csg foam
build/constants/springls.h: tests/bench/constants.py build/embed $(PARTS_FILES) $(wildcard kernels_embed/*/*.cl) | set-up
	@rm -rf build/constants && mkdir -p build/constants && cp -r src kernels_embed build/constants
	@tests/bench/constants.py parts build/constants
	@cd build/constants && ../embed src/springls_parts.h kernels_embed/device/entry_points.cl > springls.h && cp ../../springls_cl.h .
build/constants/implementation.o: examples/common/springls/implementation.c build/constants/springls.h
	$(SAY)$(CC) $(filter-out $(WARNINGS),$(EXAMPLE_FLAGS)) -O2 -Ibuild/constants -c -o $@ $<
define constants_rule
build/constants/$(1): build/constants/implementation.o $(call objects,$(1)) $(call folder_archives,$($(1)_USES))
	$$(SAY)$$(CC) $$(EXAMPLE_FLAGS) -o $$@ $$^ $($(1)_LIBS) $(call folder_libs,$($(1)_USES))
endef
$(foreach p,$(CONSTANTS_PROGRAMS),$(eval $(call constants_rule,$(p))))
constants: deps-examples   ## docs/constants.md: each tuned constant at half and twice its value (ONLY=NAME; PAGE=docs/constants.md)
	@$(if $(and $(ONLY),$(PAGE)),echo "constants: ONLY measures a part of the page: leave out ONLY or PAGE" >&2; exit 2)
	@$(MAKE) --no-print-directory $(CONSTANTS_PROGRAMS:%=build/constants/%)
	@tests/bench/constants.py measure build/constants '$(ONLY)' $(if $(PAGE),> build/constants/page && mv build/constants/page '$(PAGE)')
