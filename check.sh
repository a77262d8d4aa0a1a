#!/bin/sh
# Installs missing packages, builds everything with warnings as errors, and runs the tests.
set -eu
cd "$(dirname "$0")"

scripts/install-dependencies.sh --tests
cmake --preset release -DBUILD_TESTING=ON -DTRIP_WERROR=ON
cmake --build --preset release
ctest --preset release -j "$(nproc)" "$@"
