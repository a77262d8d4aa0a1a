#!/bin/sh
# Prints where this machine's packages of a Debian release (default: its own) come from, as apt's
# sources say in either of their forms; of several, one.
set -eu
release=${1:-$(. /etc/os-release && echo "$VERSION_CODENAME")}
# 'http://host/debian/dists/bookworm/InRelease' host_debian_dists_bookworm_InRelease 0
releases=$(apt-get --print-uris update | sed -n "s|^'\([^']*\)/dists/\([^']*\)/InRelease' .*|\2 \1|p")
# A source may name its release as `stable`; a mirror has it by its own name too.
mirror=$(echo "$releases" | sed -n "s|^$release ||p" | head -n 1)
[ "$mirror" ] || mirror=$(echo "$releases" | sed -n "s/^[a-z]*stable //p" | head -n 1)
[ "$mirror" ] || {
    echo "mirror: apt's sources have none for $release" >&2
    exit 1
}
echo "$mirror"
