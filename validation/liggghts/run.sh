#!/bin/sh
# The main case with the native engine and with LIGGGHTS, three seeds each, then result.csv and result.md; and the
# cross-check of single contacts, liggghts.csv and liggghts.png of ../engines. Runs that are already there from the same program and case are not repeated.
# Exit code 1 if one of the limits of README.md is missed; the results are written all the same.
#
# TURBID   the program, built with the feature `liggghts` (default: target/release/turbid)
# OUT      output directory (default: out/validation/liggghts in the repository)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${OUT:-$root/out/validation/liggghts}
turbid=${TURBID:-$root/target/release/turbid}
if [ ! -x "$turbid" ]; then
    (cd "$root" && cargo build --release --features liggghts)
fi
version=$("$turbid" --version)
case=$root/cases/hindered_settling.toml
made_of=$(cat "$turbid" "$case" | cksum)

# The number after a key of a summary; nothing where there is none.
of() {
    sed -n "s/^ *\"$2\": \([0-9.eE+-]*\),*$/\1/p" "$1/summary.json" | head -n 1
}

for seed in 1 2 3; do
    for engine in native liggghts; do
        run=$out/seed_${seed}_$engine
        if [ -f "$run/done" ] && [ "$(cat "$run/done")" = "$made_of" ]; then
            echo "seed $seed, $engine: already there"
            continue
        fi
        echo "seed $seed, $engine"
        "$turbid" run "$case" --out "$run" --overwrite --quiet \
            --set "dem.engine=$engine" \
            --set "particles.0.seed=$seed" \
            --set "run.end={ stokes_times = 150 }" \
            --set "run.average_from={ stokes_times = 50 }" \
            --set 'output.fields_every="never"' --set 'output.particles_every="never"'
        if ! grep -q '"interrupted": false' "$run/summary.json"; then
            echo "interrupted; start again to repeat this run" >&2
            exit 1
        fi
        echo "$made_of" > "$run/done"
    done
done

{
    echo "# Settling velocity over the Stokes velocity, cases/hindered_settling.toml, averages from 50 to 150 t*; and the same at"
    echo "# 5 t* for the start, which both engines share"
    echo "seed,engine,u,standard_error,u_at_5_t_star,mlups"
    for seed in 1 2 3; do
        for engine in native liggghts; do
            run=$out/seed_${seed}_$engine
            early=$(awk -F, '$3 + 0 >= 5 && NR > 1 { print $4; exit }' "$run/series.csv")
            echo "$seed,$engine,$(of "$run" settling_velocity_over_stokes),$(of "$run" standard_error),$early,$(of "$run" mlups)"
        done
    done
} > "$out/result.csv"

status=0
{
    echo "Made by \`run.sh\` on $(date -u +%Y-%m-%d) with $version."
    echo
    # Difference over error: that of the means over the standard error of the difference. Throughput: LIGGGHTS over native.
    awk -F, '
    function verdict(what, value, limit, holds) {
        said = said sprintf("- %s: %s, allowed %s: %s\n", what, value, limit, holds ? "holds" : "MISSED")
        if (!holds) missed = 1
    }
    function size(x) { return x < 0 ? -x : x }
    /^#/ || /^seed/ { next }
    # What a run has not written must not count as zero.
    $3 == "" || $4 == "" || $5 == "" || $6 == "" { print "a number is missing: " $0; missed = 1; exit }
    { u[$1, $2] = $3; e[$1, $2] = $4; v[$1, $2] = $5; m[$1, $2] = $6; if ($1 > n) n = $1 }
    END {
        if (missed || !n) exit 1
        print "| seed | native | LIGGGHTS | difference | over its error | at 5 t\\*, native | LIGGGHTS | difference | throughput |"
        print "|---|---|---|---|---|---|---|---|---|"
        for (s = 1; s <= n; s++) {
            a = u[s, "native"]; b = u[s, "liggghts"]; c = v[s, "native"]; d = v[s, "liggghts"]
            ea = e[s, "native"]; eb = e[s, "liggghts"]; speed = m[s, "liggghts"] / m[s, "native"]
            printf "| %d | %.4f +- %.4f | %.4f +- %.4f | %+.1f %% | %+.2f | %.4f | %.4f | %+.2f %% | %.2f |\n", s, a, ea, b, eb,
                100 * (b / a - 1), (b - a) / sqrt(ea ^ 2 + eb ^ 2), c, d, 100 * (d / c - 1), speed
            sa += a; sb += b; qa += ea ^ 2; qb += eb ^ 2; ma += m[s, "native"]; mb += m[s, "liggghts"]
            if (size(d / c - 1) > early) early = size(d / c - 1)
        }
        apart = (sb - sa) / sqrt(qa + qb)
        printf "| all | %.4f +- %.4f | %.4f +- %.4f | %+.1f %% | %+.2f | | | | %.2f |\n\n", sa / n, sqrt(qa) / n, sb / n,
            sqrt(qb) / n, 100 * (sb / sa - 1), apart, mb / ma
        verdict("difference of the means over its standard error", sprintf("%.2f", size(apart)), "1", size(apart) <= 1)
        verdict("largest difference at 5 t\\*", sprintf("%.2f %%", 100 * early), "1 %", early <= 0.01)
        verdict("throughput with LIGGGHTS over that of the native engine", sprintf("%.2f", mb / ma), "0.75 and more",
            mb / ma >= 0.75)
        printf "%s", said
        exit missed
    }' "$out/result.csv" || status=1
} > "$out/result.md"

"$turbid" crosscheck --out "$out/crosscheck" > "$out/crosscheck.txt" || status=1
cp "$out/result.csv" "$out/result.md" "$here"
for kind in csv png; do
    cp "$out/crosscheck/crosscheck.$kind" "$here/../engines/liggghts.$kind"
done
cat "$out/result.md"
tail -n 1 "$out/crosscheck.txt"
exit "$status"
