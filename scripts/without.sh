#!/bin/sh
# Builds the program three times: without the GL renderer, without OpenVDB and libnetcdf, and
# without all optional parts. Checks that each build prints its version, bricks a volume, and
# describes and draws the data set. Checks that each build refuses requests for missing parts with
# one line.
set -eu
cd "$(dirname "$0")/.."
. scripts/progress.sh
mkdir -p build

fail() { echo "without: $*" >&2; exit 1; }

# Checks that a command fails with an exit status, not a signal, and names the missing part.
refuses() { # LINE COMMAND...
    line=$1
    shift
    if "$@" > build/without.txt 2>&1; then
        fail "not refused: $*"
    elif [ $? -gt 2 ] || ! grep -q "$line" build/without.txt; then
        cat build/without.txt
        fail "not refused by a line with '$line': $*"
    fi
}

for lacks in "GL" "OPENVDB NETCDF" "SMALL"; do
    folder=build/without-$(echo "$lacks" | tr 'A-Z ' 'a-z-')
    rm -rf "$folder/cloud.trip"
    options="-DTRIP_GL=ON -DTRIP_OPENVDB=ON -DTRIP_NETCDF=ON -DTRIP_SMALL=OFF"
    for each in $lacks; do
        options="$options -DTRIP_$each=OFF"
    done
    echo "without $lacks"
    if [ "$lacks" = SMALL ]; then
        options=-DTRIP_SMALL=ON
        lacks="GL OPENVDB NETCDF IMAGES VIEW SERVE"
    fi
    # shellcheck disable=SC2086
    cmake --preset release -B "$folder" -DCMAKE_RUNTIME_OUTPUT_DIRECTORY="$PWD/$folder" \
        -DBUILD_TESTING=OFF -DTRIP_VIEW=OFF -DTRIP_SERVE=OFF $options > build/without.txt || { cat build/without.txt; exit 1; }
    : > build/without.txt
    follow_ninja build/without.txt cmake --build "$folder" --target triptych triptych-generate ${TRIP_JOBS:+-j "$TRIP_JOBS"} || { tail -20 build/without.txt; exit 1; }
    triptych=$folder/triptych
    "$triptych" --version
    "$folder/triptych-generate" --size 48 --output "$folder/cloud.nrrd" cloud
    "$triptych" brick "$folder/cloud.nrrd" --output "$folder/cloud.trip" --force --quiet
    "$triptych" info "$folder/cloud.trip" > build/without.txt
    "$triptych" render "$folder/cloud.trip" --renderer auto --size 64x64 --output "$folder/cloud.png"
    case " $lacks " in
    *" GL "*) refuses "without" "$triptych" render "$folder/cloud.trip" --renderer gl -o "$folder/gl.png" ;;
    esac
    case " $lacks " in
    *" OPENVDB "*) printf ' BDV\0\0\0\0' > "$folder/empty.vdb"
                   refuses "OpenVDB" "$triptych" brick "$folder/empty.vdb" -o "$folder/no.trip" ;;
    esac
    case " $lacks " in
    *" NETCDF "*) printf '\211HDF\r\n\032\n' > "$folder/empty.nc"
                  refuses "libnetcdf" "$triptych" brick "$folder/empty.nc" -o "$folder/no.trip" ;;
    esac
    case " $lacks " in
    *" IMAGES "*) refuses "triptych-images: was not built" "$triptych" render "$folder/cloud.trip" -o "$folder/no.jpg"
                  printf 'II*\0' > "$folder/empty.tif"
                  refuses "triptych-images: was not built" "$triptych" brick "$folder/empty.tif" -o "$folder/no.trip"
                  refuses "without the viewer" "$triptych" view "$folder/cloud.trip"
                  refuses "without the server" "$triptych" serve "$folder/cloud.trip" ;;
    esac
    echo "without $lacks: builds, says its version, bricks, describes and draws"
done
