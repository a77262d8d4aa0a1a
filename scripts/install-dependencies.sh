#!/bin/sh
# Installs missing Debian packages that Triptych's build needs. Prints progress. Works as root or with
# sudo. Needs no input, and no network if all packages are installed.
#
#   scripts/install-dependencies.sh [--small] [--tests] [--compare] [--arm64] [--avx512]
#   scripts/install-dependencies.sh --missing
#   scripts/install-dependencies.sh --libraries
#
#   --small      installs only the packages for -DTRIP_SMALL=ON
#   --tests      adds the packages of the tests
#   --compare    adds the programs that the benchmark compares with
#   --arm64      adds the packages of scripts/arm64.sh
#   --avx512     adds the packages of scripts/avx512.sh
#   --missing    installs nothing; prints the missing packages
#   --libraries  installs nothing; prints the libraries that the program and its tests link with
set -eu
. "$(dirname "$0")/progress.sh"

small_libraries="libpng-dev liburing-dev libcjson-dev libexpat1-dev libxxhash-dev libnifti-dev zlib1g-dev libbz2-dev libzstd-dev libminizip-dev libwebp-dev"
libraries="$small_libraries libnanoflann-dev libopenvdb-dev libboost-iostreams-dev libopenimageio-dev libtiff-dev libgdcm-dev libepoxy-dev
 libegl-dev libglfw3-dev libimgui-dev libmicrohttpd-dev libjpeg62-turbo-dev libseccomp-dev libnetcdf-dev"
small="cmake ninja-build gcc libc6-dev pkg-config $small_libraries"
build="$small g++ libgl1-mesa-dri libegl1 libgbm1 $libraries"
tests="libcmocka-dev python3 python3-numpy python3-pil python3-xxhash python3-openvdb clang-14 libclang-rt-14-dev clang-format-14
 valgrind xauth xvfb libxtst6 chromium ffmpeg locales mesa-vulkan-drivers"
compare="libopenvdb-tools python3-numpy python3-openvdb python3-pil python3-vtk9 xauth xvfb"
avx512="libsimde-dev"
arm64="gcc-aarch64-linux-gnu g++-aarch64-linux-gnu mmdebstrap qemu-user-static"

wanted=$build
only_print=
for option in "$@"; do
    case $option in
    --small) wanted=$small ;;
    --tests) wanted="$wanted $tests" ;;
    --compare) wanted="$wanted $compare" ;;
    --arm64) wanted="$wanted $arm64" ;;
    --avx512) wanted="$wanted $avx512" ;;
    --missing) only_print=yes ;;
    --libraries) echo "$libraries libcmocka-dev" | tr '\n' ' '; exit 0 ;;
    *) echo "install-dependencies: unknown option: $option" >&2; exit 2 ;;
    esac
done

fail() { progress_end; echo "install-dependencies: $*" >&2; exit 1; }

missing=
for package in $wanted; do
    status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
    [ "$status" = "install ok installed" ] || missing="$missing $package"
done
if [ "$only_print" ]; then
    echo "${missing# }"
    exit 0
fi
[ -n "$missing" ] || exit 0

command -v apt-get >/dev/null || fail "apt-get is missing; this script knows Debian's packages alone:$missing"
as_root=
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null ||
        fail "run as root, install sudo, or ask for: apt-get install --no-install-recommends$missing"
    as_root=sudo
    # Asks for the password before the first line of progress.
    sudo true || fail "sudo refused; ask for: apt-get install --no-install-recommends$missing"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
trap 'exit 130' INT TERM
export DEBIAN_FRONTEND=noninteractive LC_ALL=C

# apt LABEL ARGUMENTS: runs apt-get and prints its progress. The log gets all other output.
apt() {
    label=$1
    shift
    # shellcheck disable=SC2016
    {
        $as_root env LC_ALL=C DEBIAN_FRONTEND=noninteractive sh -c 'exec apt-get -q -y -o APT::Status-Fd=3 "$@" 3>&1 >&2' \
            apt "$@" 2>>"$log" </dev/null || echo "failed"
    } | {
        failed=0
        while IFS=: read -r kind _ percent note; do
            case $kind in
            dlstatus) step=$label ;;
            pmstatus) step=Installing ;;
            failed) failed=1; continue ;;
            *) continue ;;
            esac
            percent=${percent%%.*}
            case $percent in
            '' | *[!0-9]*) ;;
            *) progress "$step" "$percent" "$note" ;;
            esac
        done
        progress_end
        [ $failed = 0 ]
    }
}

started=$(date +%s)
echo "Reading apt's lists"
# A list may fail although the wanted packages are known. Then the installation decides.
apt "Reading apt's lists" update || true
# Completes an installation that was interrupted.
$as_root dpkg --configure -a >>"$log" 2>&1 </dev/null || true

# shellcheck disable=SC2086
plan=$(apt-get --print-uris -y --no-install-recommends install $missing 2>>"$log") || {
    tail -20 "$log" >&2
    fail "apt-get cannot install:$missing"
}
# apt-get prints: 0 upgraded, 85 newly installed...; Need to get 78.1 MB...; After this operation, 298 MB...
count=$(echo "$plan" | awk '/^[0-9]+ upgraded, / { print $1 + $3 }')
megabytes() { sed -n "s|$1|\\1 \\2|p" | awk '{ print int($1 * ($2 == "GB" ? 1000 : $2 == "MB" ? 1 : 0.001) + 1) }'; }
fetched=$(echo "$plan" | megabytes '^Need to get \([0-9.]*\) \([kMG]*B\).*')
grows=$(echo "$plan" | megabytes '^After this operation, \([0-9.]*\) \([kMG]*B\) of additional.*')
echo "Packages: $count, ${fetched:-0} MB to fetch, ${grows:-0} MB on disk"
room=$(free_megabytes /usr)
needed=$((${fetched:-0} + ${grows:-0}))
[ "$needed" -le "$room" ] || fail "the packages need $needed MB, but the disk of /usr has $room MB free"

# Another installation may run, for instance Debian's own updates.
# shellcheck disable=SC2086
apt Fetching -o DPkg::Lock::Timeout=300 --no-install-recommends install $missing || {
    tail -20 "$log" >&2
    fail "apt-get failed; missing:$missing"
}
echo "Packages: installed in $(duration $(($(date +%s) - started)))"
