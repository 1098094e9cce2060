#!/bin/sh
# Runs the tests of unsafe code that calls no foreign function (the memory of the fluid, its kernels, messages between threads)
# where a wrong access is seen:
#
#   scripts/miri.sh            under Miri, which interprets them: minutes to an hour
#   scripts/miri.sh address    with AddressSanitizer, which any nightly has: out of bounds and use after free only
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo

tests="
    comm::tests::every_message_to_another_rank comm::tests::one_to_eight_thread_ranks
    comm::tests::a_panicking_rank_ends_the_others comm::tests::results_come_back_by_rank
    fluid::buffer fluid::halo fluid::layout fluid::rows fluid::solid
    fluid::tests::a_cell_that_is_too_fast fluid::tests::a_measuring_sweep
    fluid::tests::any_number_of_ranks fluid::tests::the_fault_that_is_told
    fluid::tests::the_in_place_kernel_agrees fluid::tests::what_departed_from_a_cell
"
if [ "${1:-miri}" = address ]; then
    triple=$(rustc -vV | sed -n 's/^host: //p')
    # Each word of the list is a filter.
    RUSTFLAGS="-Zsanitizer=address" exec cargo +nightly test --profile dev --target "$triple" -p turbid-core --lib -- $tests
fi
cargo +nightly miri --version >/dev/null 2>&1 ||
    fail "Miri is not here, so nothing was run; rustup component add --toolchain nightly miri rust-src"
# The clock and the files of this machine are used.
MIRIFLAGS="${MIRIFLAGS:-} -Zmiri-disable-isolation" exec cargo +nightly miri test -p turbid-core --lib -- $tests
