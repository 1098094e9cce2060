#!/bin/sh
# Bits and speed of a device: result.md. Less than ten minutes on a GPU; SMALL=1 takes small boxes, for PoCL.
#
# DEVICE  the device (default: gpu)
# OUT     directory for result.md (default: this one)
# TURBID  the program (default: built here)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
device=${DEVICE:-gpu}
out=${OUT:-$here}
cd "$here/../.."
if [ -z "${TURBID:-}" ]; then
    cargo build --release --quiet
    turbid=$PWD/${CARGO_TARGET_DIR:-target}/release/turbid
    case ${CARGO_TARGET_DIR:-} in /*) turbid=$CARGO_TARGET_DIR/release/turbid ;; esac
else
    turbid=$TURBID
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

cases="cases/single_sphere cases/sphere_array cases/hindered_settling cases/hindered_settling_paper cases/cubes_settling cases/settling_tank
    cases/shear_cell cases/rotating_cylinder cases/stl_particles validation/round_walls/case validation/rolling/case
    validation/shear/spheroid validation/oscillating_flow/sphere"
if [ -n "${SMALL:-}" ]; then
    steps=4 edge=4
else
    steps=300 edge=25
fi

# The hash of the state after some steps: case, precision, options.
hash_of() {
    name=$1 precision=$2
    shift 2
    folder=$(mktemp -d "$work/run.XXXXXX")
    "$turbid" run "$name.toml" --quiet --overwrite --out "$folder" --set "fluid.precision=$precision" \
        --set "run.end.steps=$steps" --set "run.average_from={ steps = 0 }" --set output.fields_every=never \
        --set output.picture_every=never --set output.particles_every=never "$@" >&2
    sed -n 's/.*"state_hash": "\(.*\)".*/\1/p' "$folder/summary.json"
}

# Million cell updates per second, with bodies and of the fluid alone, in a row of the table: what, precision, ranks, options.
speed_of() {
    what=$1 precision=$2 ranks=$3
    shift 3
    "$turbid" bench validation/hindered_settling/case.toml --device "$device" --threads "$ranks" --steps 40 --json \
        --set lattice.cells_per_diameter=18 --set particles.0.volume_fraction=0.3 --set "fluid.precision=$precision" \
        --set "domain.size.diameters=[$edge,$edge,$edge]" "$@" > "$work/bench.json"
    of() { sed -n "s/^ *\"$1\": \([0-9]*\)[.,].*/\1/p" "$work/bench.json" | head -1; }
    echo "| $what | $precision | $ranks | $(of mlups) | $(of fluid_only_mlups) |"
}

{
    echo "Made by \`run.sh\`, $(date -u +%F)."
    echo
    echo '```text'
    "$turbid" doctor
    echo '```'
    echo
    echo "| case | precision | steps | hash of the state | device, 1, 2 and 4 ranks |"
    echo "|---|---|---|---|---|"
    for name in $cases; do
        for precision in f32 f64; do
            for on in cpu 1 2 4; do
                options="--device $device --threads $on"
                [ "$on" = cpu ] && options=
                # shellcheck disable=SC2086
                (hash_of "$name" "$precision" $options > "$work/$on") &
            done
            wait
            expected=$(cat "$work/cpu") found=
            for on in 1 2 4; do
                hash=$(cat "$work/$on")
                [ -n "$expected" ] && [ "$hash" = "$expected" ] && hash=equal
                found="$found $hash"
            done
            echo "| $name | $precision | $steps | $expected |$found |"
        done
    done
    cells=$((edge * 18))
    echo
    echo "Million cell updates per second, $cells x $cells x $cells cells:"
    echo
    echo "| what | precision | ranks | with bodies | fluid alone |"
    echo "|---|---|---|---|---|"
    for ranks in 1 4; do
        speed_of "spheres, volume fraction 0.3, 18 cells per diameter" f32 $ranks
        speed_of "the same" f64 $ranks
        speed_of "cubes of the same volume" f32 $ranks --set 'particles.0.shape={ cube = { equivalent_diameter = 1.5e-3 } }'
    done
} > "$out/result.md.part"
mv "$out/result.md.part" "$out/result.md"
cat "$out/result.md"
