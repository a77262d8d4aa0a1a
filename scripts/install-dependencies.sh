#!/bin/sh
# Installs missing Debian packages that Triptych's build needs. Works as root or with sudo. Needs no
# input, and no network if all packages are installed.
#
#   scripts/install-dependencies.sh [--tests] [--compare] [--arm64] [--avx512]
#   scripts/install-dependencies.sh --libraries
#
#   --tests      adds the packages of the tests
#   --compare    adds the programs that the benchmark compares with
#   --arm64      adds the packages of scripts/arm64.sh
#   --avx512     adds the packages of scripts/avx512.sh
#   --libraries  installs nothing; prints the libraries that the program and its tests link with
set -eu

libraries="libopenvdb-dev libboost-iostreams-dev libopenimageio-dev libtiff-dev libgdcm-dev libepoxy-dev libegl-dev libglfw3-dev
 libimgui-dev libmicrohttpd-dev libjpeg62-turbo-dev libpng-dev
 liburing-dev libseccomp-dev libnetcdf-dev libcjson-dev libexpat1-dev libxxhash-dev libnifti-dev zlib1g-dev libbz2-dev"
build="cmake ninja-build gcc g++ pkg-config libgl1-mesa-dri libegl1 libgbm1 $libraries"
tests="libcmocka-dev python3 python3-numpy python3-pil python3-xxhash python3-openvdb clang-14 libclang-rt-14-dev clang-format-14
 valgrind xauth xvfb libxtst6 chromium ffmpeg locales"
compare="libopenvdb-tools python3-numpy python3-openvdb python3-pil python3-vtk9 xauth xvfb"
avx512="libsimde-dev"
arm64="gcc-aarch64-linux-gnu g++-aarch64-linux-gnu mmdebstrap qemu-user-static"

wanted=$build
for option in "$@"; do
    case $option in
    --tests) wanted="$wanted $tests" ;;
    --compare) wanted="$wanted $compare" ;;
    --arm64) wanted="$wanted $arm64" ;;
    --avx512) wanted="$wanted $avx512" ;;
    --libraries) echo "$libraries libcmocka-dev" | tr '\n' ' '; exit 0 ;;
    *) echo "install-dependencies: unknown option: $option" >&2; exit 2 ;;
    esac
done

missing=
for package in $wanted; do
    status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
    [ "$status" = "install ok installed" ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

as_root=
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
        echo "install-dependencies: run as root or install sudo; missing:$missing" >&2
        exit 1
    }
    as_root=sudo
fi
echo "Installing:$missing"
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086
if ! { $as_root apt-get -q update && $as_root apt-get -q install -y --no-install-recommends $missing; } >"$log" 2>&1; then
    tail -20 "$log" >&2
    echo "install-dependencies: apt-get failed; missing:$missing" >&2
    exit 1
fi
