#!/bin/sh
# The tests, and every fuzzer over its corpus for a few seconds (TRIP_FUZZ_SECONDS each, default 5),
# under AddressSanitizer with UBSan, and those in which threads meet under ThreadSanitizer. What is
# left out of the first, and why, is in tests/CMakeLists.txt; of the second, OpenVDB and GL, which
# none of its tests use. The first runs with intercept_tls_get_addr=0 (CMakePresets.json): otherwise
# the search for leaks takes the place of a library's thread-local data from a header that glibc no
# longer writes, and now and then reads at a wild address. The second runs with die_after_fork=0:
# some tests start the bricker's threads in a forked child, to kill it.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests

cmake --preset asan -DTRIP_FUZZ_SECONDS="${TRIP_FUZZ_SECONDS:-5}"
cmake --build --preset asan
ctest --preset asan -j "$(nproc)" -LE unsanitized

cmake --preset tsan
cmake --build --preset tsan --target threaded_tests
ctest --preset tsan -j "$(nproc)" -L threads
