# Sourced by ./run and ./test: installs what is missing, builds, and says in one line what went wrong.
# Everything here talks on stderr: stdout belongs to the program that is run in the end.

# Debian's packages, by purpose.
packages_library=(g++ cmake ninja-build libtbb-dev libhwy-dev)
packages_run=("${packages_library[@]}" libcli11-dev nlohmann-json3-dev libfast-float-dev libassimp-dev libzstd-dev
              libcpp-httplib-dev pkg-config zlib1g-dev) # which libassimp-dev links with but doesn't bring
packages_test=("${packages_run[@]}" libgtest-dev librapidcheck-dev libgmp-dev clang-19 libclang-rt-19-dev clang-format-19
               assimp-testmodels python3 gnuplot-nox valgrind)
packages_c=(golang-go luajit abigail-tools) # languages that call the C interface; what compares binaries
packages_csharp=(mono-mcs mono-runtime)
packages_python=(pybind11-dev python3-dev python3-numpy python3-build python3-venv python3-pytest mypy python3-matplotlib python3-ase)
packages_rust=(cargo)
packages_bullet=(libbullet-dev) # what there are adapters for
packages_fcl=(libfcl-dev)
packages_mpi=(libopenmpi-dev openmpi-bin libtrilinos-zoltan-dev)
packages_package=(lintian pybind11-dev python3-dev python3-numpy file)
packages_platforms=(g++-mingw-w64-x86-64-posix wine wine64 g++-aarch64-linux-gnu g++-s390x-linux-gnu qemu-user googletest
                    emscripten) # of 840 MB
packages_docs=(mkdocs mkdocs-material doxygen python3-numpy libbullet-dev libfcl-dev libopenmpi-dev) # the latter for blocks of code
packages_web=(emscripten libhwy-dev cmake ninja-build python3) # the npm package
command -v node >/dev/null || packages_web+=(nodejs)
command -v npm >/dev/null || packages_web+=(npm)
packages_browser=("${packages_web[@]}" chromium) # of 410 MB

say() { printf '%s\n' "$*" >&2; }
fail() {
    say "${0##*/}: $*"
    exit 1
}

# as_root COMMAND...
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif [ -t 0 ]; then
        sudo "$@"
    else
        sudo -n "$@" # nobody there to type a password
    fi
}

# install_packages PACKAGE...: those of them that are missing.
install_packages() {
    if ! command -v dpkg-query >/dev/null; then
        command -v cmake >/dev/null && command -v ninja >/dev/null ||
            fail "this system has no apt; install by hand what these Debian packages hold, then try again: $*"
        return 0 # they may all be there under other names; CMake says which one isn't
    fi
    local missing=() installed package
    installed=" $(dpkg-query -W -f '${db:Status-Status}:${Package} ' "$@" 2>/dev/null)"
    for package in "$@"; do
        [[ $installed == *" installed:$package "* ]] || missing+=("$package")
    done
    [ ${#missing[@]} = 0 ] && return 0

    command -v apt-get >/dev/null || fail "this system has no apt-get; install these packages by hand: ${missing[*]}"
    [ "$(id -u)" = 0 ] || command -v sudo >/dev/null ||
        fail "no root and no sudo here; have an administrator run: apt-get install ${missing[*]}"
    say "Installing with apt: ${missing[*]}"
    mkdir -p build || fail "can't write to $PWD"
    local log=build/apt.log apt=(env DEBIAN_FRONTEND=noninteractive apt-get -y -o Dpkg::Use-Pty=0
                                 -o DPkg::Lock::Timeout=400)
    if { as_root "${apt[@]}" update && as_root "${apt[@]}" install --no-install-recommends "${missing[@]}"; } \
        </dev/null 2>&1 | tee "$log" | sed -u -n 's/^\(Get:[0-9]*\|Setting up\|E:\|sudo:\) /  &/p' >&2; then
        return 0
    fi
    if grep -qE 'sudo: .*(password|not allowed)' "$log"; then
        fail "sudo wants a password; run as root: apt-get install ${missing[*]}"
    elif grep -qiE 'no space left|enough free space' "$log"; then
        fail "the disk is full; free at least 3 GB and try again"
    elif grep -q 'Could not get lock' "$log"; then
        fail "another program holds apt's lock for minutes; let it finish and try again"
    elif grep -qiE 'temporary failure|could not resolve|could not connect|unreachable|connection failed|timed out' "$log"; then
        fail "apt can't reach its servers; check the network connection and try again (all it said: $log)"
    elif grep -qE 'Unable to locate package|has no installation candidate' "$log"; then
        fail "$(grep -oE -m1 "(Unable to locate package .*|Package '.*' has no installation candidate)" "$log"):" \
            "this isn't Debian 12; install its like by hand"
    fi
    fail "apt-get failed: $(grep -m1 '^E:' "$log"); all it said is in $log"
}

# How many compilers at a time: one a core, but each may need 1.5 GB of memory.
job_count() {
    if [ -n "${CMAKE_BUILD_PARALLEL_LEVEL-}" ]; then
        echo "$CMAKE_BUILD_PARALLEL_LEVEL"
        return
    fi
    local cores memory
    cores=$(nproc)
    memory=$(awk '/^MemAvailable:/ { print int($2 / 1500000) }' /proc/meminfo)
    ((memory < 1)) && memory=1
    echo $((cores < memory ? cores : memory))
}

# Where ccache is installed, what was compiled before, in another clone as well, isn't compiled again.
if [ -z "${CMAKE_CXX_COMPILER_LAUNCHER-}" ] && command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
fi

# configure PRESET: where that is due.
configure() {
    local preset=$1 dir=build/$1 key
    # What CMake found, or didn't, stays so until it is asked again.
    key=$(cat CMakePresets.json cmake/bootstrap.sh | sha256sum)$PWD$(ls -d /usr/include/bullet /usr/include/fcl /usr/include/trilinos 2>/dev/null | tr '\n' ' ')$(command -v wine qemu-aarch64 qemu-s390x em++ chromium npm tsc cargo go luajit mcs mono abidiff valgrind mypy pytest-3 mkdocs doxygen mpiexec | tr '\n' ' ')
    if [ ! -f "$dir/build.ninja" ] || [ "$(cat "$dir/configured" 2>/dev/null)" != "$key" ]; then
        if grep -qs '^CMAKE_HOME_DIRECTORY' "$dir/CMakeCache.txt" &&
            ! grep -q "^CMAKE_HOME_DIRECTORY:INTERNAL=$PWD\$" "$dir/CMakeCache.txt"; then
            rm -rf "$dir" # this folder was moved or copied, and CMake refuses what it made elsewhere
        fi
        say "Configuring $dir"
        mkdir -p "$dir" || fail "can't write to $PWD/build"
        cmake --preset "$preset" >"$dir/configure.log" 2>&1 || {
            cat "$dir/configure.log" >&2
            fail_build "CMake couldn't configure $dir; what it said is above"
        }
        echo "$key" >"$dir/configured" || fail_build "can't write to $dir"
    fi
}

# build PRESET TARGET...: configures where that is due and builds with visible progress.
build() {
    local dir=build/$1
    configure "$1"
    shift
    NINJA_STATUS='[%f/%t, %es] ' cmake --build "$dir" --parallel "$(job_count)" --target "$@" >&2 ||
        fail_build "the build failed; the compiler's first message is above. If the sources are unchanged, remove $dir and try again"
}

# fail_build MESSAGE: unless the reason is plain.
fail_build() {
    local free
    free=$(df -Pk . | awk 'NR == 2 { print $4 }')
    ((free < 100000)) && fail "the disk is full; free at least 3 GB and try again"
    fail "$1"
}
