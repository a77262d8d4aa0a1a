#!/bin/sh
# Cross-compiles for 64-bit ARM and runs the CPU renderer's tests in qemu, including the NEON
# kernels. This takes minutes. Options replace the default choice of tests and go to ctest. Tests
# that start a program need binfmt_misc, so that Linux starts qemu for the program, and
# QEMU_LD_PREFIX with the path of build/arm64-sysroot.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests --arm64

# Unpacks ARM's libraries instead of installing them, so that this machine's packages stay
# unchanged.
libraries=$(scripts/install-dependencies.sh --libraries)
release=$(. /etc/os-release && echo "$VERSION_CODENAME")
root=$(pwd)/build/arm64-sysroot
if [ "$(cat "$root/packages" 2>/dev/null)" != "$release $libraries" ]; then
    echo "Fetching and unpacking ARM's packages takes minutes"
    mirror=$(scripts/mirror.sh "$release")
    mkdir -p build
    rm -rf "$root"
    # shellcheck disable=SC2016
    mmdebstrap --quiet --mode=chrootless --variant=extract --arch=arm64 --include="libc6-dev $libraries" \
        --setup-hook='mkdir -p "$1/usr/lib" && ln -s usr/lib "$1/lib"' \
        "$release" "$root" "$mirror"
    # Makes the links that an installation would make: relative links, and the alternatives.
    find "$root/usr/lib" -lname '/*' | while read -r link; do
        ln -sfnr "$root$(readlink "$link")" "$link"
    done
    for name in blas lapack; do
        ln -sf "$name/lib$name.so.3" "$root/usr/lib/aarch64-linux-gnu/lib$name.so.3"
    done
    echo "$release $libraries" >"$root/packages"
fi

cmake --preset arm64 -DTRIP_WERROR=ON
cmake --build --preset arm64
[ $# -gt 0 ] || set -- -R '^test_(cpu|gaussian)' -j "$(nproc)"
ctest --preset arm64 "$@"
