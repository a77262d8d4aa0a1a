#!/bin/sh
# Installs missing packages, builds, draws an included volume, and prints the path of the picture.
set -eu
cd "$(dirname "$0")"

scripts/install-dependencies.sh
cmake --preset release -DBUILD_TESTING=OFF >build.log 2>&1 && cmake --build --preset release >>build.log 2>&1 || {
    tail -20 build.log >&2
    echo "demo: the build failed; the whole log is build.log" >&2
    exit 1
}

triptych=build/release/triptych
mkdir -p demo
$triptych render datasets/tooth.nhdr -o demo/tooth.png
echo "The picture: $(pwd)/demo/tooth.png"
