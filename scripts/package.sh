#!/bin/sh
# Makes the packages of the program, in target/package (below CARGO_TARGET_DIR, if that is set), and prints their sizes:
#
#   turbid-VERSION-x86_64-linux.tar.gz      to be unpacked anywhere
#   turbid_VERSION-1_amd64.deb              for Debian 12, Ubuntu 22.04, and later ones
#   turbid-VERSION-*.whl                    the Python package, with the program
#
#   scripts/package.sh                      all three; --no-deb, --no-wheel: without that one, and without what it needs
#   scripts/package.sh --try                then installs each in a clean Debian, runs the first case, removes it, and looks for what
#                                           is left; --source as well: `pip install ./ffi/python` there (needs root and debootstrap)
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo
need_linker

deb=yes wheel=yes try= source=
for option; do
    case $option in
    --no-deb) deb= ;;
    --no-wheel) wheel= ;;
    --try) try=yes ;;
    --source) source=yes ;;
    *) fail "$option is no option; see the head of this file" ;;
    esac
done

target=${CARGO_TARGET_DIR:-$PWD/target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' crates/cli/Cargo.toml | head -1)
name=turbid-$version-$(uname -m)-linux
out=$target/package
limit=15000000
cargo_deb=3.8.0

rm -rf "$out"
mkdir -p "$out"
# Together: cargo would compile all but the last crates a second time for the module (ffi/python/backend.py).
cargo build --locked --profile dist --package turbid-cli ${wheel:+--package turbid-python}
size=$(stat -c %s "$target/dist/turbid")
[ "$size" -lt $limit ] || fail "the program has $size bytes, more than $limit: see [profile.dist] in Cargo.toml"
glibc=$(grep -ao 'GLIBC_2\.[0-9]*' "$target/dist/turbid" | sort -uV | tail -n 1)
[ "$(printf '%s\n' "$glibc" GLIBC_2.35 | sort -V | tail -n 1)" = GLIBC_2.35 ] ||
    fail "the program needs $glibc, docs/install.md says 2.35: build it on an older system"
stage=$target/dist/stage
scripts/stage.sh "$target/dist/turbid" "$stage"
tar --create --gzip --owner=0 --group=0 --sort=name --transform "s,^\.,$name," --file "$out/$name.tar.gz" --directory "$stage" .

if [ "$deb" ]; then
    tools=$PWD/target/tools
    if [ "$("$tools/bin/cargo-deb" --version 2>/dev/null)" != "cargo-deb $cargo_deb" ]; then
        echo "building cargo-deb $cargo_deb" >&2
        cargo install cargo-deb --version "=$cargo_deb" --locked --quiet --debug --config profile.dev.debug=0 \
            --target-dir "$target/cargo-deb" --root "$tools" --force
    fi
    "$tools/bin/cargo-deb" --package turbid-cli --profile dist --no-build --no-strip --locked --quiet --output "$out/"
fi
if [ "$wheel" ]; then
    need_python
    python=$target/python/bin/python
    "$python" -m pip --version >/dev/null 2>&1 || python3 -m venv --clear "$target/python"
    maturin=$(grep '^maturin==' ffi/python/tests/requirements.txt)
    "$python" -m pip install --quiet --disable-pip-version-check "$maturin"
    "$python" ffi/python/backend.py
    "$python" -m maturin build --quiet --locked --profile dist --manifest-path ffi/python/Cargo.toml --out "$out"
fi
(cd "$out" && sha256sum turbid* >SHA256SUMS)
echo "$size turbid"
(cd "$out" && stat -c '%s %n' turbid*)
[ -z "$try" ] || exec scripts/try_packages.sh "$out" "$PWD" "$source"
