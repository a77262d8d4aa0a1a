#!/bin/sh
# Builds for 64-bit ARM on another machine and passes the CPU renderer's tests in qemu, NEON's
# kernels among them: minutes. Options go to ctest in place of the choice of those tests; where a
# test starts a program, the kernel has to start qemu for it (binfmt_misc) and QEMU_LD_PREFIX name the
# unpacked packages, build/arm64-sysroot.
set -eu
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh --tests --arm64

# ARM's libraries, unpacked and not installed, so that this machine's packages stay as they are.
libraries=$(scripts/install-dependencies.sh --libraries)
release=$(. /etc/os-release && echo "$VERSION_CODENAME")
root=$(pwd)/build/arm64-sysroot
if [ "$(cat "$root/packages" 2>/dev/null)" != "$release $libraries" ]; then
    mirror=$(scripts/mirror.sh "$release")
    mkdir -p build
    rm -rf "$root"
    # shellcheck disable=SC2016
    mmdebstrap --quiet --mode=chrootless --variant=extract --arch=arm64 --include="libc6-dev $libraries" \
        --setup-hook='mkdir -p "$1/usr/lib" && ln -s usr/lib "$1/lib"' \
        "$release" "$root" "$mirror"
    # What would be installed with them: links that do not leave the folder, and the alternatives.
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
[ $# -gt 0 ] || set -- -R '^test_cpu' -j "$(nproc)"
ctest --preset arm64 "$@"
