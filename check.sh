#!/bin/sh
# Installs missing packages, builds everything with warnings as errors, and runs the tests.
set -eu
cd "$(dirname "$0")"

scripts/install-dependencies.sh --tests
# Undoes the choice of an interrupted demo.sh.
cmake --preset release -DBUILD_TESTING=ON -DTRIP_WERROR=ON -DTRIP_SMALL=OFF
cmake --build --preset release
ctest --preset release -j "$(nproc)" "$@"
