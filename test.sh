#!/bin/sh
# Everything that must hold: format, lints, dependencies, documentation, and every test, with all features and without. Installs what it
# misses.
set -eu
cd "$(dirname "$0")"
. ./scripts/setup.sh
need_cargo
need_linker
need_features mpi,liggghts
need_device
need_lammps
need_c
need_python
need_browser
cargo fmt --version >/dev/null 2>&1 || fail "rustfmt is missing; run: rustup component add rustfmt"
cargo clippy --version >/dev/null 2>&1 || fail "clippy is missing; run: rustup component add clippy"

stage() {
    name=$1
    shift
    echo "== $name" >&2
    start=$(date +%s)
    "$@"
    echo "   $name took $(($(date +%s) - start)) s" >&2
}

stage format cargo fmt --all --check
stage lints cargo clippy --locked --workspace --all-targets --all-features --quiet -- -D warnings
stage dependencies ./scripts/dependencies.sh
stage documentation env RUSTDOCFLAGS="-D warnings" \
    cargo doc --locked --workspace --no-deps --all-features --document-private-items --quiet
stage book ./scripts/docs.sh
# Without features only their absence differs: all tests compile, and what is refused is said. Nothing is computed, so nothing is
# optimised.
stage "lints without features" cargo clippy --locked --all-targets --quiet -- -D warnings
stage "lints of the library alone" cargo clippy --locked --package turbid --lib --no-default-features --quiet -- -D warnings
stage "tests without features" env CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=false \
    cargo test --locked --profile dev --test program bad_input
stage "tests of the Python package" ./scripts/python.sh
# One build for all tests: the profile `test` is optimised and keeps assertions and overflow checks. There are a device, if only the
# processor, LAMMPS and a browser; tests that need one of them must not pass without.
echo "== tests" >&2
exec env TURBID_NEEDS_DEVICE=1 TURBID_NEEDS_LAMMPS=1 TURBID_NEEDS_BROWSER=1 cargo test --locked --workspace --all-features
