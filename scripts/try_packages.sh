#!/bin/sh
# Installs the packages of a folder in a clean Debian, runs the first case with each, removes it, and looks for what is left. Part of
# scripts/package.sh --try; needs root, debootstrap and a network.
#
#   scripts/try_packages.sh FOLDER REPOSITORY [yes: `pip install` of the sources, too]
set -eu
packages=$(realpath "$1")
repository=$(realpath "$2")
source=${3:-}
. "$repository/scripts/setup.sh"
[ "$(id -u)" = 0 ] || fail "--try needs root"
have debootstrap || install_packages debootstrap debootstrap

base=${TURBID_ROOT:-$packages/../clean-debian}
root=$base.now
if [ ! -e "$base/etc/debian_version" ]; then
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -1)
    debootstrap --variant=minbase bookworm "$base" "$mirror" >/dev/null
fi
# Nothing is removed while something of this machine is mounted there.
cleanup() {
    for at in root/.rustup proc; do
        if mountpoint -q "$root/$at"; then
            umount "$root/$at" || true
        fi
        ! mountpoint -q "$root/$at" || fail "$root/$at is still mounted: unmount it, then remove $root"
    done
    rm -rf --one-file-system "$root"
}
cleanup
trap cleanup EXIT
trap 'exit 130' INT TERM HUP
cp -a "$base" "$root"

# Runs a command there, in an empty folder.
inside() {
    chroot "$root" /bin/sh -eu -c "export PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin HOME=/root; mkdir -p /try; cd /try; $1"
}

# Runs the first case by the program of this name; prints the time until there was a picture, start to end, and looks at the files.
first_run() {
    start=$(date +%s%N)
    inside "$1 run $2/single_sphere.toml --out first --quiet 2>/dev/null & run=\$!
        while [ -z \"\$(ls first/pictures 2>/dev/null)\" ] && kill -0 \$run; do sleep 0.1; done; kill \$run; wait \$run || true
        ls first/pictures/*.png first/open.py >/dev/null; rm -rf first"
    echo "  first picture after $((($(date +%s%N) - start) / 1000000)) ms"
}

mount -t proc proc "$root/proc"
cp /etc/resolv.conf "$root/etc/"
cp "$packages"/turbid* "$repository/cases/single_sphere.toml" "$root/opt/"

echo "archive:"
inside 'mkdir /opt/prefix; tar xzf /opt/turbid-*.tar.gz -C /opt/prefix --strip-components=1; /opt/prefix/bin/turbid --version'
first_run /opt/prefix/bin/turbid /opt/prefix/share/doc/turbid/examples
rm -r "$root/opt/prefix"

if any_file "$packages"/*.deb; then
    echo "Debian package:"
    inside 'dpkg -i /opt/turbid_*.deb >/dev/null; turbid --version; ls /usr/share/bash-completion/completions/turbid >/dev/null'
    [ -n "$(ls "$root"/usr/share/man/man1/turbid-run.1*)" ] || echo "  (no manual pages: minbase leaves them out)"
    first_run turbid /usr/share/doc/turbid/examples
    inside 'dpkg --purge turbid >/dev/null'
    left=$(find "$root/usr" "$root/etc" "$root/var" "$root/try" -name '*turbid*')
    [ -z "$left" ] || fail "left after the removal: $left"
    echo "  removed, nothing left"
fi

# The example of ffi/python/README.md.
awk '/^```python/ { on = 1; next } /^```/ { on = 0 } on' "$repository/ffi/python/README.md" >"$root/opt/example.py"
inside 'apt-get update -q >/dev/null; DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
    python3 python3-venv >/dev/null 2>&1; python3 -m venv /opt/venv'
mkdir -p "$root/etc/ssl/certs"
cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
if any_file "$packages"/*.whl; then
    echo "wheel:"
    inside '/opt/venv/bin/pip install -q /opt/turbid-*.whl; /opt/venv/bin/turbid --version; /opt/venv/bin/python /opt/example.py'
    first_run /opt/venv/bin/turbid /opt
fi

if [ "$source" ]; then
    need_cargo
    echo "sources, by pip:"
    mkdir -p "$root/opt/turbid" "$root/root/.cargo" "$root/root/.rustup"
    git -C "$repository" archive HEAD | tar x -C "$root/opt/turbid"
    cp -a "${CARGO_HOME:-$HOME/.cargo}/." "$root/root/.cargo"
    mount --bind "${RUSTUP_HOME:-$HOME/.rustup}" "$root/root/.rustup"
    mount -o remount,bind,ro "$root/root/.rustup"
    inside 'DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends gcc libc6-dev >/dev/null 2>&1
        python3 -m venv --clear /opt/venv; PATH=/root/.cargo/bin:$PATH /opt/venv/bin/pip install -q /opt/turbid/ffi/python
        /opt/venv/bin/turbid --version; /opt/venv/bin/python /opt/example.py'
fi
