#!/bin/sh
# The main case with the native engine and with LIGGGHTS, three seeds each, then result.csv and result.md; and the
# cross-check of single contacts, crosscheck.csv. Runs that are already there are not repeated.
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

# The number after a key of a summary; nothing where there is none.
of() {
    sed -n "s/^ *\"$2\": \([0-9.eE+-]*\),*$/\1/p" "$1/summary.json" | head -n 1
}

for seed in 1 2 3; do
    for engine in native liggghts; do
        run=$out/seed_${seed}_$engine
        if [ -f "$run/done" ] && [ "$(cat "$run/done")" = "$version" ]; then
            echo "seed $seed, $engine: already there"
            continue
        fi
        echo "seed $seed, $engine"
        "$turbid" run "$root/cases/hindered_settling.toml" --out "$run" --quiet \
            --set "dem.engine=$engine" \
            --set "particles.0.seed=$seed" \
            --set "run.end={ stokes_times = 150 }" \
            --set "run.average_from={ stokes_times = 50 }" \
            --set 'output.fields_every="never"' --set 'output.particles_every="never"'
        if ! grep -q '"interrupted": false' "$run/summary.json"; then
            echo "interrupted; start again to repeat this run" >&2
            exit 1
        fi
        echo "$version" > "$run/done"
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

{
    echo "Made by \`run.sh\` on $(date -u +%Y-%m-%d) with $version."
    echo
    echo "| seed | native | LIGGGHTS | difference | at 5 t\\*, native | LIGGGHTS | difference |"
    echo "|---|---|---|---|---|---|---|"
    awk -F, '
    /^#/ || /^seed/ { next }
    { u[$1, $2] = $3; e[$1, $2] = $4; v[$1, $2] = $5; if ($1 > n) n = $1 }
    END {
        for (s = 1; s <= n; s++) {
            a = u[s, "native"]; b = u[s, "liggghts"]; c = v[s, "native"]; d = v[s, "liggghts"]
            printf "| %d | %.4f +- %.4f | %.4f +- %.4f | %+.1f %% | %.4f | %.4f | %+.2f %% |\n", s, a, e[s, "native"], b, e[s, "liggghts"],
                100 * (b / a - 1), c, d, 100 * (d / c - 1)
            sa += a; sb += b; qa += e[s, "native"] ^ 2; qb += e[s, "liggghts"] ^ 2
        }
        printf "| all | %.4f +- %.4f | %.4f +- %.4f | %+.1f %% | | | |\n", sa / n, sqrt(qa) / n, sb / n, sqrt(qb) / n, 100 * (sb / sa - 1)
    }' "$out/result.csv"
} > "$out/result.md"

"$turbid" crosscheck --out "$out/crosscheck" > "$out/crosscheck.txt"
cp "$out/result.csv" "$out/result.md" "$here"
cp "$out/crosscheck/crosscheck.csv" "$here"
cat "$out/result.md"
tail -n 1 "$out/crosscheck.txt"
