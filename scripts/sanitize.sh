#!/bin/sh
# Runs the tests and the fuzzers with sanitizers, in two builds.
#
# AddressSanitizer with UBSan: the tests, and each fuzzer for TRIP_FUZZ_SECONDS (default 5) from its
# corpus. tests/CMakeLists.txt lists the tests left out, with reasons. intercept_tls_get_addr=0
# (CMakePresets.json) avoids crashes: the leak search would read the address of a library's
# thread-local data from a header that glibc no longer writes.
#
# ThreadSanitizer: the tests with several threads, without OpenVDB and GL, which these tests do not
# use. die_after_fork=0 is needed, since some tests start the bricker's threads in a forked child to
# kill it.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests

cmake --preset asan -DTRIP_FUZZ_SECONDS="${TRIP_FUZZ_SECONDS:-5}"
cmake --build --preset asan
ctest --preset asan -j "$(nproc)" -LE unsanitized

cmake --preset tsan
cmake --build --preset tsan --target threaded_tests
ctest --preset tsan -j "$(nproc)" -L threads
