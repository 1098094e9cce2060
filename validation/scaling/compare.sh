#!/bin/sh
# A guard of the speed, for every night: what particles cost beside the fluid, compared with recorded ratios.
#
#   ./compare.sh                compares; exit code 3 if a case is slower by more than the tolerance
#   ./compare.sh --record       writes the recorded ratios; on a quiet machine
#
# TURBID      the program (default: target/release/turbid)
# RATIOS      folder of the recorded ratios (default: ratios beside this file)
# TOLERANCE   part by which a ratio may fall (default: 0.1)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
ratios=${RATIOS:-$here/ratios}
turbid=${TURBID:-$root/target/release/turbid}
if [ -z "${TURBID:-}" ]; then
    (cd "$root" && cargo build --release --locked)
fi
case ${1:-} in
'' | --record) ;;
*)
    echo "usage: compare.sh [--record]" >&2
    exit 2
    ;;
esac

# One thread and one instruction set, which most machines have: a ratio depends on both.
bench() {
    name=$1
    shift
    "$turbid" bench "$root/cases/$name.toml" --threads 1 --set run.simd='"avx2"' --steps 100 --warm-up 200 "$@"
}

# The one number that is compared: machines differ in all others.
ratio() {
    sed -n 's/^ *"four_way_over_fluid_only": \([0-9.e-]*\),*$/\1/p'
}

worst=0
for name in hindered_settling cubes_settling stl_particles shear_cell; do
    file=$ratios/$name.json
    echo "$name" >&2
    if [ "${1:-}" = --record ]; then
        mkdir -p "$ratios"
        bench "$name" --json > "$file.part"
        mv "$file.part" "$file"
        continue
    fi
    now=$(bench "$name" --json | ratio)
    then=$(ratio <"$file")
    verdict=pass
    if ! awk -v now="$now" -v then="$then" -v part="${TOLERANCE:-0.1}" 'BEGIN { exit !(now >= (1 - part) * then) }'; then
        verdict=FAIL
        worst=3
    fi
    echo "$name: speed with particles over fluid only $now, recorded $then: $verdict"
done
exit "$worst"
