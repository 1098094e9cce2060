#!/bin/sh
# Ranks as threads and as MPI processes, side by side: speed, messages, memory, and what each part of a step costs; then
# result.csv, result.md and cost.md.
#
#   ./run.sh                    the study: 7 rounds after 1000 steps of warm-up; a quarter of an hour on two quiet cores
#   ./run.sh ROUNDS WARM_UP     a trial of another length; its tables go to the output directory only
#
# TURBID   the program (default: target/release/turbid, built with the feature `mpi`)
# OUT      output directory (default: out/validation/scaling in the repository)
# MPIRUN   the launcher (default: mpirun)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
rounds=${1:-7}
warm_up=${2:-1000}
out=${OUT:-$root/out/validation/scaling}
mpirun=${MPIRUN:-mpirun}
turbid=${TURBID:-$root/target/release/turbid}
if [ -z "${TURBID:-}" ]; then
    (cd "$root" && cargo build --release --locked --features mpi)
fi
version=$("$turbid" --version)
mkdir -p "$out"

# Open MPI: as root, and ranks that the system moves between cores as it does threads.
export OMPI_MCA_hwloc_base_binding_policy=none
if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

# Most seconds that a run may take: one that hangs is a failure, not a wait.
limit=600

# turbid bench on this number of ranks, "threads" or "mpi", to a file. The rest are its arguments.
bench() {
    file=$1 ranks=$2 kind=$3
    shift 3
    case $kind in
    threads)
        timeout --kill-after=5 $limit "$turbid" bench "$@" --threads "$ranks" --json > "$file"
        ;;
    mpi)
        timeout --kill-after=5 $limit "$mpirun" -n "$ranks" "$turbid" bench "$@" --json > "$file"
        ;;
    crowded)
        OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 \
            timeout --kill-after=5 $limit "$mpirun" -n "$ranks" "$turbid" bench "$@" --json > "$file"
        ;;
    esac
}

# The number after a key of the whole report, of one of its parts, and of a key in a part in a part.
of() {
    sed -n "s/^  \"$2\": \([0-9.eE+-]*\),*$/\1/p" "$1"
}
part() {
    sed -n "/^  \"$2\": {/,/^  }/s/^    \"$3\": \([0-9.eE+-]*\),*$/\1/p" "$1"
}
mean() {
    sed -n "/^  \"$2\": {/,/^  }/p" "$1" | sed -n "/^    \"$3\": {/,/^    }/s/^      \"mean\": \([0-9.eE+-]*\),*$/\1/p"
}
sum_of_ranks() {
    sed -n "/^  \"by_rank\": /,\$s/^      \"$2\": \([0-9.eE+-]*\),*$/\1/p" "$1" | awk '{ s += $1 } END { print s }'
}

paper=$root/cases/hindered_settling_paper.toml
small="domain.size={ diameters = [6, 6, 6] }"

line() {
    file=$1 name=$2
    echo "$name,$(of "$file" ranks),$3,$(of "$file" cells),$(of "$file" mlups),$(of "$file" bandwidth_gb_per_s),$(of "$file" contacts),$(of "$file" messages_per_step),$(of "$file" bytes_per_step),$(of "$file" memory_per_rank_bytes),$(mean "$file" waiting_over_ranks halo),$(mean "$file" waiting_over_ranks exchange)"
}

csv=$out/result.csv
{
    echo "# Hindered settling, 18 cells per diameter, volume fraction 0.3: the case of Marquardt et al. (2024), f32; $version"
    echo "# L 6 D: 1000 steps of warm-up, $rounds rounds of the three in turn; crowded: more MPI processes than cores; L 12 D: memory only"
    echo "# messages and bytes per step of the rank with the most; memory per rank in bytes; waiting: seconds per step and rank"
    echo "case,ranks,kind,cells,mlups,bandwidth_gb_per_s,contacts,messages_per_step,bytes_per_step,memory_per_rank,waiting_halo,waiting_exchange"
} > "$csv"

# The three in turn, so that a change of the machine meets all of them.
round=1
while [ "$round" -le "$rounds" ]; do
    for run in "1 threads" "2 threads" "2 mpi"; do
        set -- $run
        file=$out/pair_$1_$2_$round.json
        bench "$file" "$1" "$2" "$paper" --set "$small" --steps 40 --warm-up "$warm_up"
        line "$file" "L 6 D" "$2" >> "$csv"
    done
    echo "round $round of $rounds" >&2
    round=$((round + 1))
done

for ranks in 4 8; do
    echo "$ranks processes" >&2
    file=$out/crowded_$ranks.json
    bench "$file" "$ranks" crowded "$paper" --set "$small" --steps 20 --warm-up 20
    line "$file" "L 6 D" crowded >> "$csv"
done

echo "memory of the case of the paper" >&2
bench "$out/memory_1.json" 1 threads "$paper" --steps 1 --warm-up 8
line "$out/memory_1.json" "L 12 D" threads >> "$csv"
bench "$out/memory_8.json" 8 crowded "$paper" --steps 1 --warm-up 8
line "$out/memory_8.json" "L 12 D" crowded >> "$csv"

cores=$(getconf _NPROCESSORS_ONLN)
awk -F, -v version="$version" -v cores="$cores" -v rounds="$rounds" -f "$here/median.awk" -f "$here/result.awk" "$csv" > "$out/result.md"

# What each part costs: differences of runs on two threads, so that both cores share the memory as in a run.
echo "costs" >&2
{
    echo "edge,cells,sweep"
    for edge in 4 6 8; do
        file=$out/fluid_$edge.json
        bench "$file" 2 threads "$paper" --set "domain.size={ diameters = [$edge, $edge, $edge] }" --steps 40 --warm-up 20 --fluid-only
        echo "$edge,$(of "$file" cells),$(mean "$file" stages_over_ranks fluid)"
    done
} > "$out/cells.csv"
bench "$out/free.json" 2 threads "$paper" --set "$small" --steps 40 --warm-up 100 --no-contact
bench "$out/dry_few.json" 1 threads "$root/cases/dry_box.toml" --steps 50 --warm-up 20
bench "$out/dry_many.json" 1 threads "$root/cases/dry_box.toml" --steps 50 --warm-up 4000
touching=$out/pair_1_threads_1.json
bench "$out/touching_none.json" 1 threads "$paper" --set "$small" --steps 40 --warm-up "$warm_up" --no-contact
network=$out/pair_2_mpi_1.json
{
    sed 's/^/cells,/' "$out/cells.csv"
    echo "free,$(of "$out/free.json" cells),$(sum_of_ranks "$out/free.json" covered_cells),$(mean "$out/free.json" stages_over_ranks map),$(mean "$out/free.json" stages_over_ranks fluid)"
    echo "sphere,$(of "$touching" particles),$(of "$touching" contacts),$(part "$touching" stages dem),$(part "$out/touching_none.json" stages dem)"
    echo "polyhedron,$(of "$out/dry_few.json" particles),$(of "$out/dry_few.json" contacts),$(part "$out/dry_few.json" stages dem),$(of "$out/dry_many.json" contacts),$(part "$out/dry_many.json" stages dem)"
    echo "network,$(part "$network" network seconds_per_message),$(part "$network" network seconds_per_byte),$(part "$network" network seconds_per_reduction)"
} > "$out/cost.csv"
awk -F, -v version="$version" -f "$here/cost.awk" "$out/cost.csv" > "$out/cost.md"

if [ "$rounds $warm_up" = "7 1000" ]; then
    cp "$csv" "$out/result.md" "$out/cost.md" "$here"
fi
cat "$out/result.md" "$out/cost.md"
