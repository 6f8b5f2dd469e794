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
