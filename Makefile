# springls: what there is to build, test and measure. `make` alone lists it.
#
#   CC=clang CXX=clang++   other compilers        OPT=-O1   optimisation        CFLAGS=...   more flags
#   NATIVE=1               tune for this machine  V=1       print the commands
#   OPENMP=1               the library's loops by OpenMP instead of its own threads, for comparison
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
                $(THREADS) $(NIFTI) $(CFLAGS)
THREADS       = -DSPRINGLS_THREADS -pthread $(if $(filter 1,$(OPENMP)),-fopenmp)
# Debian's NIfTI headers want their own folder in the search path.
NIFTI         = -isystem /usr/include/nifti $(if $(GDCM),-isystem $(GDCM)) $(if $(MAXFLOW),-isystem $(MAXFLOW))
# Folders of DICOM files are read where GDCM is.
GDCM         := $(patsubst %/gdcmImageReader.h,%,$(lastword $(wildcard /usr/include/gdcm-*/gdcmImageReader.h)))
# segment cuts graphs where libmaxflow is.
MAXFLOW      := $(patsubst %/maxflow.h,%,$(lastword $(wildcard /usr/include/maxflow-*/maxflow.h)))

PARTS_FILES  := $(wildcard src/*.h src/*/*.h kernels_embed/*/*.h)
# The top of the OpenCL text; it includes the rest.
DEVICE_TEXT  := kernels_embed/device/entry_points.cl
ifdef SPRINGLS_DATA
  export SPRINGLS_DATA
endif

.PHONY: help constants deps measurements deps-examples deps-display deps-test deps-elastix deps-opencl deps-bench check examples demo test test-all test-rest test-build test-run fresh bench busy paper ablation motions morph-pairs rigs accuracy long coverage cover-lines \
        segmentation registration imaging solids set-mesh tilings install uninstall format clean \
        docs docs-check asan tsan msan lives valgrind deps-valgrind oclgrind rusticl device gpu-text deps-rusticl deps-oclgrind deps-gpu-text fuzz deps-fuzz compile-matrix deps-matrix portability deps-portability deps-python wheel web web-test deps-web deps-web-test npm deps-npm packages deps-packages deps-engines deps-cohort deps-slurm deps-dicom deps-maxflow FORCE
.DELETE_ON_ERROR:
# What is made on the way to something else stays too.
.SECONDARY:

help:   ## this list
	@sed -n 's/^\([a-z.-]*\):.*## */\1\t/p' $(MAKEFILE_LIST) | expand -t 18

# ---- set-up: finds what is missing and installs it, saying so ----

deps: deps-test deps-examples deps-display deps-opencl   ## install what demo and test need, where missing

DEPS = CC="$(CC)" CXX="$(CXX)" HEAD_SCAN="$(HEAD_SCAN)" .ci/deps.sh

deps-examples deps-display deps-test deps-elastix deps-opencl deps-rusticl deps-oclgrind deps-valgrind deps-gpu-text deps-fuzz deps-bench deps-matrix deps-portability deps-python deps-web deps-web-test deps-npm deps-packages deps-engines deps-cohort deps-slurm deps-dicom deps-maxflow:
	@$(DEPS) $(@:deps-%=%)

# ---- the product ----

build/embed: kernels_embed/embed.c | set-up
	@mkdir -p build
	$(SAY)$(CC) $(STRICT) -O1 -o $@ $<

build/springls.h.new: build/embed $(PARTS_FILES) $(wildcard kernels_embed/*/*.cl)
	@build/embed src/springls_parts.h $(DEVICE_TEXT) > $@

# Written only where its text differs: the file times of a fresh clone mean nothing, and nothing is compiled again for them.
springls.h: build/springls.h.new   ## put the parts together again, if one has changed
	@cmp -s $< $@ || { echo "  $@"; cp $< $@; }

# springls.h is no prerequisite: what is checked is the file as it is, not as make would refresh it.
check: build/embed check-folders   ## is springls.h what the parts produce? are all includes of lower folders? is the OpenCL text clean? are lines short, and names no macros of programs?
	@build/embed src/springls_parts.h $(DEVICE_TEXT) > build/springls.h.check
	@cmp -s springls.h build/springls.h.check || { \
	  echo "check: springls.h is not what src/ and kernels_embed/ produce: run 'make springls.h' and commit it;"; \
	  echo "       if it was edited by hand, put that change into the part first. First difference:"; \
	  diff springls.h build/springls.h.check | head -n 5; exit 1; }
	@CC="$(CC)" tests/portability/text.sh
	@if command -v python3 > /dev/null; then tests/bench/constants.py check .; \
	  else echo "check: no python3: whether tests/bench/constants.py fits the parts is not checked"; fi
	@CC="$(CC)" tests/portability/alone.sh $(filter-out src/%_parts.h,$(PARTS_FILES))
	@$(CC) $(STRICT) -I. -o build/print_kernels tests/portability/print_kernels.c -lm
	@build/print_kernels > build/kernels.cl
	@awk -f tests/portability/kernel_rules.awk build/kernels.cl
	@tests/portability/kernels.sh build/kernels.cl

SETTINGS = $(CC) $(CXX) $(OPT) $(NATIVE) $(THREADS) $(GDCM) $(MAXFLOW) $(CFLAGS)
# What a folder was built with. A change of it, say CC=clang or OPENMP=1, builds everything there again.
.PRECIOUS: %/settings
%/settings: FORCE
	@mkdir -p $(@D)
	@echo '$(SETTINGS)' | cmp -s - $@ || echo '$(SETTINGS)' > $@

include examples/examples.mk
include tests/tests.mk
include tests/bench/bench.mk

# ---- pages ----

docs: deps-examples   ## the figures and pictures of the pages, made anew by the commands that stand in them (PAGE=morph, PAGE=morph:2)
	@docs/pages.py $(PAGE)

docs-check: deps-examples   ## do the pages have what their commands print? all that is quick enough; times may differ (PAGE=)
	@docs/pages.py --check --only check $(PAGE)

# ---- the rest ----

# What is installed is the file as it is: springls.h is no prerequisite.
INCLUDES   = $(DESTDIR)$(PREFIX)/include
PKG_CONFIG = $(DESTDIR)$(PREFIX)/share/pkgconfig
CMAKE      = $(DESTDIR)$(PREFIX)/share/cmake/springls
VERSION    = $(shell sed -n 's/^#define SPRINGLS_VERSION_[A-Z]* \([0-9]*\)$$/\1/p' springls.h | paste -s -d .)

install:   ## copy the headers to $(DESTDIR)$(PREFIX)/include, and what pkg-config and CMake find them by
	install -d '$(INCLUDES)' '$(PKG_CONFIG)' '$(CMAKE)'
	install -m 644 springls.h springls_cl.h '$(INCLUDES)'
	printf '%s\n' 'includedir=$(PREFIX)/include' '' 'Name: springls' \
	  'Description: Spring Level Sets: deformable surfaces in a C99 header' 'Version: $(VERSION)' \
	  'Cflags: -I$${includedir}' 'Libs: -lm' > '$(PKG_CONFIG)/springls.pc'
	chmod 644 '$(PKG_CONFIG)/springls.pc'
	install -m 644 packages/cmake/springlsConfig.cmake packages/cmake/springlsConfigVersion.cmake '$(CMAKE)'

uninstall:   ## remove what install has copied
	rm -f '$(INCLUDES)/springls.h' '$(INCLUDES)/springls_cl.h' '$(PKG_CONFIG)/springls.pc'
	rm -rf '$(CMAKE)'

format:   ## lay out FILES="..." as .clang-format says (an aid: formulas are better laid out by hand)
	$(if $(FILES),clang-format -i $(FILES),@echo 'which? make format FILES="src/new.h"'; exit 2)

clean:   ## remove build/
	rm -rf build

-include $(wildcard build/bench/*.d)
