#!/bin/sh
# Passes the tests of the CPU renderer's kernels, those for AVX-512 among them, on a processor
# without it: SIMDe's functions do what the instructions would. Minutes. Options go to ctest in
# place of the choice of those tests.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests --avx512
cmake --preset avx512 -DTRIP_WERROR=ON
cmake --build --preset avx512
[ $# -gt 0 ] || set -- -R '^test_(cpu|hard|depth|scale|uneven|effects|emission)' -j "$(nproc)"
ctest --preset avx512 "$@"
