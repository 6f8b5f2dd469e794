#!/bin/bash
# packages.sh [NAME]: does a program find springls through each package system? Every check begins in a folder of its own, with what it
# installs there; NAME: that one alone. From the repository's root; prints what fails, and "N passed, N failed". Systems that are missing
# are skipped, but one that is named fails.
set -u
only=${1:-}
root=$PWD out=$PWD/build/packages
rm -rf "$out"; mkdir -p "$out"
passed=0 failed=0
version=$(sed -n 's/^#define SPRINGLS_VERSION_[A-Z]* \([0-9]*\)$/\1/p' springls.h | paste -s -d .)

check() {   # NAME COMMAND...
    local name=$1; shift
    [ -z "$only" ] || [ "$only" = "$name" ] || return 0
    mkdir "$out/$name"
    if (cd "$out/$name" && cp "$root/examples/minimal.c" . && "$@") > "$out/$name.log" 2>&1; then passed=$((passed + 1)); echo "ok   $name"
    else failed=$((failed + 1)); echo "FAIL $name"; tail -n 20 "$out/$name.log"; fi
}

# A program for CMake that gets the library by $1.
cmake_program() {
    { echo 'cmake_minimum_required(VERSION 3.14)'; echo 'project(program C)'; echo "$1"
      echo 'add_executable(program minimal.c)'; echo 'target_link_libraries(program PRIVATE springls::springls)'; } > CMakeLists.txt
    cmake -S . -B build "-DCMAKE_PREFIX_PATH=$PWD/prefix" && cmake --build build && ./build/program
}
find_package() {
    cmake -S "$root" -B install "-DCMAKE_INSTALL_PREFIX=$PWD/prefix" && cmake --install install &&
        cmake_program "find_package(springls ${version%.*} REQUIRED)"
}
# By make instead, into DESTDIR, and from there to where it is used. Another minor version is refused; uninstall leaves no file.
make_install() {
    make -s -C "$root" install "DESTDIR=$PWD/stage" PREFIX=/opt/springls && mv stage/opt/springls prefix &&
        cmake_program "find_package(springls ${version%.*} REQUIRED)" && rm -r build &&
        ! cmake_program "find_package(springls ${version%%.*}.999 REQUIRED)" &&
        make -s -C "$root" uninstall "PREFIX=$PWD/prefix" && [ -z "$(find prefix -type f)" ]
}
fetch_content() { cmake_program "include(FetchContent)
FetchContent_Declare(springls SOURCE_DIR $root)
FetchContent_MakeAvailable(springls)"; }
subdirectory() { cmake_program "add_subdirectory($root springls)"; }

# The recipe of vcpkg, with the three functions of vcpkg that it calls replaced by what they stand for.
vcpkg_recipe() {
    cat > run.cmake <<END
set(CURRENT_PACKAGES_DIR "$PWD/packages")
function(vcpkg_cmake_configure _ source)
    execute_process(COMMAND cmake -S "\${source}" -B build -DCMAKE_INSTALL_PREFIX=$PWD/packages COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_install)
    execute_process(COMMAND cmake --install build COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_config_fixup _ folder)
    file(RENAME "\${CURRENT_PACKAGES_DIR}/\${folder}" "\${CURRENT_PACKAGES_DIR}/moved")
    file(RENAME "\${CURRENT_PACKAGES_DIR}/moved" "\${CURRENT_PACKAGES_DIR}/share/springls")
endfunction()
include("$root/packages/vcpkg/portfile.cmake")
END
    cmake -P run.cmake && [ -s packages/share/springls/copyright ] && [ -s packages/include/springls.h ] &&
        [ -s packages/share/springls/springlsConfig.cmake ] && grep -q "\"version\": \"$version\"" "$root/packages/vcpkg/vcpkg.json"
}

meson_program() {   # with what is on the command line
    { echo "project('program', 'c')"; echo "executable('program', 'minimal.c', dependencies: dependency('springls', version: '$version'))"; } > meson.build
    meson setup "$@" build && meson compile -C build && ./build/program
}
meson_wrap() {
    mkdir subprojects && sed "s|^url = .*|url = file://$root|" "$root/packages/meson/springls.wrap" > subprojects/springls.wrap &&
        ln -s "$root" subprojects/springls && meson_program
}
meson_installed() {
    meson setup --prefix "$PWD/prefix" install "$root" && meson install -C install &&
        PKG_CONFIG_PATH=$(dirname "$(find prefix -name springls.pc)") meson_program
}

pkg_config() {
    make -s -C "$root" install PREFIX="$PWD/prefix" && export PKG_CONFIG_PATH=$PWD/prefix/share/pkgconfig &&
        ${CC:-cc} -std=c99 $(pkg-config --cflags springls) minimal.c $(pkg-config --libs springls) -o program && ./program
}

conan_recipe() {
    if command -v conan; then CONAN_HOME=$PWD/home; export CONAN_HOME; conan profile detect && conan create "$root/packages/conan"
    else /usr/bin/python3 -c 'import sys; compile(open(sys.argv[1]).read(), sys.argv[1], "exec")' "$root/packages/conan/conanfile.py"; fi
}

# The archive of Python's module, the wheel that is built from it, and the module in an environment of its own: by pip where there is
# one, else by what pip does. Nothing is fetched.
wheel() {
    local python=/usr/bin/python3 backend=$root/packages/python/backend.py built
    export CFLAGS=-O1
    $python "$backend" sdist . && tar xzf "springls-$version.tar.gz" &&
        built=$($python "springls-$version/backend.py" wheel .) && [ "$(wc -c < "$built")" -le 3000000 ] &&
        $python -m venv --system-site-packages --without-pip environment || return 1
    if $python -m pip --version; then environment/bin/python -m pip install --no-index --no-deps "./$built"
    else $python -m zipfile -e "$built" "$(environment/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')"; fi || return 1
    cd environment && bin/python -c '
import os, sys, springls
assert springls.__file__.startswith(sys.prefix + os.sep), springls.__file__
model = springls.Model((32, 32, 32))
model.set_implicit(lambda x: ((x - 16) ** 2).sum(axis=1) ** .5 - 8)
model.step(dt=1, velocity=lambda x, time: x * 0 + [1, 0, 0])
print(model.measure().volume)
assert abs(model.measure().volume / 2144.66 - 1) < .01'
}

# The same by pip, as a user would.
pip_wheel() {
    CFLAGS=-O1 "$1" -m pip wheel --no-index --no-deps --wheel-dir wheels "$root/packages/python" && ls wheels/*.whl
}

# The package for JavaScript: made and installed without a network into an empty project, and run there by node and a browser: the bits are
# those of a native program. README's example is run as it stands.
npm_package() {
    make -s -C "$root" npm && [ "$(wc -c < "$root/build/npm/springls-$version.tgz")" -le 1000000 ] &&
        [ ! -e "$root/packages/npm/springls.wasm" ] && echo '{"type": "module"}' > package.json &&
        npm install --offline --no-audit --no-fund "$root/build/npm/springls-$version.tgz" &&
        cp "$root"/tests/portability/npm/* . || return 1
    ${CC:-cc} -std=c99 -O1 "-I$root" native.c -o native -lm && ./native > native.txt &&
        sed -n '/^```js$/,/^```$/{/^```/!p}' node_modules/springls/README.md > readme.js &&
        node readme.js | grep '^[0-9]* triangles, volume [0-9]*$' && node run.js node || return 1
    local browser=${CHROMIUM:-$(command -v chromium-headless-shell chromium | head -n 1)}
    if [ -n "$browser" ]; then node run.js "$browser"; else echo 'skip: there is no Chromium'; fi
}

# The printers of gdb on a program that has stopped; and all that Visual Studio would evaluate, which gdb can as well.
debugger() {
    ${CC:-cc} -std=c99 -g -O0 "-I$root" minimal.c -o program -lm || return 1
    sed -n 's|.*<Item [^>]*>\([^<,]*\).*|\1|p; s|.*<DisplayString Condition="\([^"]*\)">.*|\1|p' "$root/packages/debuggers/springls.natvis" > names
    sed -n '/springls_context/,$s|.*<DisplayString[^>]*>\(.*\)</DisplayString>|\1|p' "$root/packages/debuggers/springls.natvis" |
        grep -o '{[^}]*}' | tr -d '{}' >> names
    [ "$(wc -l < names)" -ge 10 ] || return 1
    { echo "source $root/packages/debuggers/springls_gdb.py"; echo 'set print elements 4'; echo 'break springls_measure'; echo run
      echo 'print *ctx'; echo 'print ctx->model.set.s[0]'; echo 'info springl ctx 3'
      sed 's/.*/print sizeof(ctx->&)/' names; } > commands
    gdb -batch -nx -x commands ./program > shown 2>&1; cat shown
    grep -q '= model of 5240 springls, grid 64 x 64 x 64, [0-9]* active bricks, time 0, between steps$' shown &&
        grep -q '= springl p (.*) q (.*) (.*) (.*)$' shown && grep -q '^springl 3, id 3, generation 0$' shown &&
        [ "$(grep -c '^\$[0-9]* = [0-9]*$' shown)" = "$(wc -l < names)" ]
}

if command -v gdb > /dev/null; then check debugger debugger; fi
if command -v cmake > /dev/null; then
    check find-package find_package; check make-install make_install; check fetch-content fetch_content; check subdirectory subdirectory; check vcpkg vcpkg_recipe
fi
if command -v meson > /dev/null; then check meson-wrap meson_wrap; check meson-installed meson_installed; fi
if command -v pkg-config > /dev/null; then check pkg-config pkg_config; fi
check conan conan_recipe
if /usr/bin/python3 -c 'import cffi, numpy, venv' 2> /dev/null; then check wheel wheel
else echo 'skip wheel: the system has no Python with cffi, numpy and venv (python3-cffi, python3-numpy)'; fi
if python3 -m pip --version > /dev/null 2>&1; then check pip-wheel pip_wheel python3; else echo 'skip pip-wheel: there is no pip'; fi
if command -v emcc > /dev/null && command -v npm > /dev/null; then check npm npm_package
else echo 'skip npm: emcc or npm is missing (emscripten, npm)'; fi
if [ -n "$only" ] && [ $((passed + failed)) = 0 ]; then failed=1; echo "FAIL $only: there is no such check, or what it needs is missing"; fi
echo "$passed passed, $failed failed"
[ $failed = 0 ]
