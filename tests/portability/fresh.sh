#!/bin/sh
# fresh.sh TARGET...: does `make TARGET` work where nothing was installed? Each target gets a bare Debian of the running release with
# make as the only addition, in it a clone of what is committed here, and runs there as a user would run it. From the repository's
# root; ends with 77, and says why, where no such system can be made; without a target that is all it finds out.
#
# In build/fresh stay the bare system, the packages that were fetched, and the system in which a target failed. Mounts lie in a
# namespace of their own: they end with the processes in it, also when those are killed.
set -u
fresh=$PWD/build/fresh bare=$PWD/build/fresh/bare root=$PWD/build/fresh/root

skip() { echo "fresh: skipped: $1"; exit 77; }
alone() { unshare --mount --pid --fork --kill-child "$@"; }

# The sources that this machine's apt has of the release, as lines of sources.list; where it has no lists yet, Debian's own.
sources() {
    apt-get indextargets --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Identifier: Packages' 'Origin: Debian' |
        grep " $VERSION_CODENAME" || echo "deb http://deb.debian.org/debian $VERSION_CODENAME main"
}

make_bare_system() {
    echo "fresh: a bare Debian $VERSION_CODENAME, build/fresh/bare"
    rm -rf "$bare" "$bare.new"
    mkdir -p "$fresh/packages"
    apt-config dump | grep -i '^Acquire::https\?::Proxy' > "$fresh/apt.conf"
    sources | mmdebstrap --quiet --mode=root --variant=minbase --include=make "--aptopt=$fresh/apt.conf" "$VERSION_CODENAME" "$bare.new" - &&
        echo force-unsafe-io > "$bare.new/etc/dpkg/dpkg.cfg.d/fast" && mv "$bare.new" "$bare"
}

# What runs in the namespace: mounts, then make as the only process that the system has.
inside='
cd "$1" && mount -t proc proc proc && mount --rbind /dev dev && mount --rbind /sys sys &&
mount --bind "$2" var/cache/apt/archives || exit 1
[ -z "$4" ] || { mkdir -p shared/data && mount --bind "$4" shared/data && mount -o remount,bind,ro shared/data; } || exit 1
exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root ${4:+SPRINGLS_DATA=/shared/data} \
    ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} ${no_proxy:+"no_proxy=$no_proxy"} \
    chroot . make -C /springls "$3"'

try() {
    begin=$(date +%s)
    echo "fresh: make $1"
    rm -rf "$root" && cp -a "$bare" "$root" && cp -L /etc/resolv.conf /etc/hosts "$root/etc" &&
        git clone --quiet --no-hardlinks "$PWD" "$root/springls" &&
        alone sh -c "$inside" sh "$root" "$fresh/packages" "$1" "$data"
    status=$?
    [ $status != 0 ] || rm -rf "$root"
    echo "fresh: make $1 ended with $status after $(($(date +%s) - begin)) s"
    return $status
}

[ "$(id -u)" = 0 ] || skip "it takes root"
for command in mmdebstrap git unshare; do command -v $command > /dev/null || skip "there is no $command"; done
. /etc/os-release
[ "$ID" = debian ] && [ -n "${VERSION_CODENAME:-}" ] || skip "this system is no release of Debian"
alone true 2> /dev/null || skip "nothing can be mounted here"
[ -x "$bare/usr/bin/make" ] || make_bare_system || exit 1
data=
[ -z "${SPRINGLS_DATA:-}" ] || data=$(cd "$SPRINGLS_DATA" && pwd) || exit 1
failed=0
for target; do try "$target" || failed=1; done
exit $failed
