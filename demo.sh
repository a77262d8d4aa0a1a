#!/bin/sh
# Draws an included volume and prints the path of the picture. Installs missing packages and builds.
# On a machine that lacks packages, the picture comes first: the script installs the packages of a
# small program, builds it and draws. Then it installs and builds the rest. Run again, it goes on where
# it stopped.
set -eu
cd "$(dirname "$0")"
. scripts/progress.sh

started=$(date +%s)
build=build/release
need_mb=60 # of the build folder
picture=
step=0

fail() { progress_end; echo "demo: $*" >&2; exit 1; }
elapsed() { duration $(($(date +%s) - started)); }
step() { step=$((step + 1)); echo "Step $step of $steps: $*"; }
stop() {
    progress_end
    if [ "$picture" ]; then
        echo "demo: stopped; the picture and $build/triptych stay, and ./demo.sh goes on from here" >&2
    else
        echo "demo: stopped; ./demo.sh goes on from here" >&2
    fi
    trap - INT
    kill -INT $$
}
trap stop INT

show_log() {
    progress_end
    tail -20 build.log >&2
    fail "$1 failed; the whole log is build.log"
}

configure() { # OPTIONS...
    cmake --preset release "$@" >build.log 2>&1 || show_log "configuring"
}

# Uses the flags of check.sh, so that check.sh does not compile all again. Warnings of another compiler
# are no errors.
configure_first() { # OPTIONS...
    werror=OFF
    [ "${CC-}${CFLAGS-}" ] || [ "$(gcc -dumpversion)" != 12 ] || werror=ON
    configure -DBUILD_TESTING=OFF -DTRIP_WERROR=$werror "$@"
}

compile() { # TARGET
    room=$(free_megabytes .)
    [ -e $build/triptych ] || [ "$room" -ge $need_mb ] ||
        fail "the build needs $need_mb MB, but $(pwd) has $room MB free"
    follow_ninja build.log cmake --build --preset release --target "$1" || show_log "building"
}

draw() {
    mkdir -p demo
    $build/triptych render datasets/tooth.nhdr -o demo/tooth.png || fail "drawing failed"
    picture=$(pwd)/demo/tooth.png
    echo "The picture: $picture"
    echo "Time: $(elapsed)"
}

is_small() { grep -q '^TRIP_SMALL:BOOL=ON' $build/CMakeCache.txt 2>/dev/null; }

steps=2
missing=$(scripts/install-dependencies.sh --missing)
if [ "$missing" ] && { is_small || [ ! -e $build/CMakeCache.txt ]; }; then
    steps=4
    step "the packages that the picture needs"
    scripts/install-dependencies.sh --small
    step "a program that draws NRRD, NIfTI and raw data with the CPU"
    configure_first -DTRIP_SMALL=ON
    compile triptych
    draw
    echo "The program $build/triptych works now. The rest follows: window, browser, OpenGL, DICOM, image"
    echo "stacks, OpenVDB, netCDF-4, the library. Ctrl-C ends it and keeps the program."
fi

step "all packages"
scripts/install-dependencies.sh ||
    fail "the other packages are not installed${picture:+; the picture and $build/triptych stay}"
step "the whole program"
if is_small; then
    configure -DTRIP_SMALL=OFF
elif [ ! -e $build/build.ninja ]; then
    configure_first
fi
compile installable
[ "$picture" ] || draw
[ $steps = 2 ] || echo "All is built. Time: $(elapsed)"
