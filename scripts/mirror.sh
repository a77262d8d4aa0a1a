#!/bin/sh
# Prints the address of the mirror from which apt fetches packages of a Debian release (default:
# this machine's release). Reads apt's sources in both of their forms. Prints one address if there
# are several.
set -eu
release=${1:-$(. /etc/os-release && echo "$VERSION_CODENAME")}
# apt-get prints lines like this one:
# 'http://host/debian/dists/bookworm/InRelease' host_debian_dists_bookworm_InRelease 0
releases=$(apt-get --print-uris update | sed -n "s|^'\([^']*\)/dists/\([^']*\)/InRelease' .*|\2 \1|p")
# A source may name its release `stable`. Its mirror has the release under its own name too.
mirror=$(echo "$releases" | sed -n "s|^$release ||p" | head -n 1)
[ "$mirror" ] || mirror=$(echo "$releases" | sed -n "s/^[a-z]*stable //p" | head -n 1)
[ "$mirror" ] || {
    echo "mirror: apt's sources have none for $release" >&2
    exit 1
}
echo "$mirror"
