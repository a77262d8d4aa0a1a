#!/bin/sh
# Installs missing packages, builds everything with warnings as errors, and runs the tests.
set -eu
cd "$(dirname "$0")"

scripts/install-dependencies.sh --tests
# Undoes the choice of an interrupted demo.sh.
cmake --preset release -DBUILD_TESTING=ON -DTRIP_WERROR=ON -DTRIP_SMALL=OFF
cmake --build --preset release
status=0
ctest --preset release -j "$(nproc)" "$@" || status=$?
awk '/^[0-9]+\/[0-9]+ Testing: / { test = $3 }
     /^skipped|^\[  SKIPPED \] |\.\.\. skipped / && !/listed below/ && !seen[test $0]++ {
         if (!count++) print "Skipped tests and parts of tests:"
         print test ": " $0
     }' build/release/Testing/Temporary/LastTest.log
exit "$status"
