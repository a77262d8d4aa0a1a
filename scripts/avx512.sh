#!/bin/sh
# Runs the tests of the CPU renderer's kernels, including the AVX-512 kernels, on a processor
# without AVX-512. SIMDe emulates the instructions. This takes minutes. Options replace the default
# choice of tests and go to ctest.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests --avx512
cmake --preset avx512 -DTRIP_WERROR=ON
cmake --build --preset avx512
[ $# -gt 0 ] || set -- -R '^test_(cpu|gaussian|hard|depth|scale|uneven|effects|emission)' -j "$(nproc)"
ctest --preset avx512 "$@"
