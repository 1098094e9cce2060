#!/bin/sh
# Holds what Cargo.lock names against deny.toml: licences, known faults (advisories/), duplicates, sources.
#
#   scripts/dependencies.sh                   checks; builds cargo-deny once if it is not here (80 s on two cores)
#   scripts/dependencies.sh --refresh CLONE   takes advisories/ anew from a clone of https://github.com/rustsec/advisory-db
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo

version=0.20.2
tools=$PWD/target/tools
# The name that this version gives to the copy of the list of `db-urls` in deny.toml.
list=$tools/advisory-dbs/advisory-db-3157b0e258782691

# The crates that are not of this workspace.
foreign() {
    awk -F'"' '/^name =/ { name = $2 } /^source =/ { print name }' Cargo.lock | sort -u
}

if [ "${1:-}" = --refresh ]; then
    rm -rf advisories/crates
    for crate in $(foreign); do
        [ ! -d "$2/crates/$crate" ] || { mkdir -p advisories/crates && cp -r "$2/crates/$crate" advisories/crates/; }
    done
    sed -i "s/^As of .*/As of $(git -C "$2" log -1 --format='%cs, commit %H')./" advisories/README.md
fi

# A new crate may have advisories that the list, made for others, leaves out.
known=$(foreign)
[ "${1:-}" != --refresh ] || echo "$known" >advisories/crates.txt
new=$(echo "$known" | grep -vxFf advisories/crates.txt || true)
[ -z "$new" ] || fail "advisories/ was made without $(echo $new); take it anew: scripts/dependencies.sh --refresh CLONE"

if [ "$("$tools/bin/cargo-deny" --version 2>/dev/null)" != "cargo-deny $version" ]; then
    echo "building cargo-deny $version" >&2
    cargo install cargo-deny --version "=$version" --locked --quiet --debug --config profile.dev.debug=0 \
        --root "$tools" --force
fi
rm -rf "$list"
mkdir -p "$list/.git"
cp -r advisories/crates "$list/"
# It looks here for the age of the list, which is the business of whoever refreshes it.
touch "$list/.git/FETCH_HEAD"
# What other systems need is looked at, too, and then the network is not used.
cargo fetch --locked --quiet
"$tools/bin/cargo-deny" --workspace --locked --offline check --hide-inclusion-graph
