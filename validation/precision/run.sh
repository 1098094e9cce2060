#!/bin/sh
# Cases of `turbid validate` and hindered settling with populations in f64, f32 and f16: result.csv and, as a table, result.md. Ten
# minutes on two cores.
#
# TURBID   the program (default: target/release/turbid)
# OUT      directory for the two (default: this one)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${OUT:-$here}
turbid=${TURBID:-$root/target/release/turbid}
if [ -z "${TURBID:-}" ]; then
    (cd "$root" && cargo build --release --locked)
fi
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
mkdir -p "$out"

cases="shear_wave taylor_green channel sphere_array periodic_settling settling_tank"
for precision in f64 f32 f16; do
    key="fluid.precision=\"$precision\""
    # Exit code 3: a check failed, which is what the table is about.
    # shellcheck disable=SC2086
    "$turbid" validate $cases --set "$key" --out "$runs/$precision" >/dev/null || [ $? = 3 ]
    "$turbid" run "$root/cases/hindered_settling.toml" --quiet --set "$key" --set 'run.end={ stokes_times = 5 }' \
        --set "output.directory=\"$runs/settling_$precision\"" --set 'output.fields_every="never"' \
        --set 'output.particles_every="never"' --set 'output.picture_every="never"'
done

# Precision, case, quantity, measured, reference; of settling the mean over the rows and the last row.
{
    echo "precision,case,quantity,measured,reference"
    for precision in f64 f32 f16; do
        awk -v precision="$precision" -f "$here/values.awk" "$runs/$precision/validation.csv"
        awk -F, -v precision="$precision" '
            NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^settling_velocity_over_stokes/) at = i; next }
            { sum += $at; last = $at; rows++ }
            END {
                printf "%s,hindered_settling,\"U / U_Stokes, mean of 5 t*\",%.9g,\n", precision, sum / rows
                printf "%s,hindered_settling,\"U / U_Stokes at 5 t*\",%.9g,\n", precision, last
            }' "$runs/settling_$precision/series.csv"
    done
} >"$out/result.csv.part"
awk -f "$here/result.awk" "$out/result.csv.part" >"$out/result.md.part"
mv "$out/result.csv.part" "$out/result.csv"
mv "$out/result.md.part" "$out/result.md"
cat "$out/result.md"
