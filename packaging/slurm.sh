#!/bin/bash
# A run of any length as a Slurm job: it stops with a checkpoint before the time limit, is queued again, and resumes, until the case
# is complete.
#
#   sbatch packaging/slurm.sh CASE.toml [DIR]         results in DIR, by default out/CASE; with a copy of the case, slurm-job.toml
#   sbatch --nodes=4 --ntasks=256 --cpus-per-task=1 packaging/slurm.sh CASE.toml      with a program built for MPI
#
# Set TURBID to a program that is not on PATH, also one in a container: TURBID="apptainer run turbid.sif".
#SBATCH --job-name=turbid
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=32
#SBATCH --time=12:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@120
set -u
case=${1:?usage: sbatch slurm.sh CASE.toml [DIR]}
out=${2:-out/$(basename "$case" .toml)}

# Whether there is a checkpoint to resume from.
saved() {
    compgen -G "$out/checkpoints/step-*" >/dev/null
}

# What the first start notes in the folder of the results: the number of its job, and the case.
note=$out/slurm-job.toml
this="# Slurm job ${SLURM_JOB_ID:-none}"
same() {
    [ -e "$note" ] && tail -n +2 "$note" | cmp -s - "$case"
}

[ -r "$case" ] || { echo "error: cannot read $case" >&2; exit 2; }
if saved; then
    if ! same; then
        echo "error: the checkpoints in $out are not of this script with the present $case; name another folder, or run: turbid resume $out" >&2
        exit 2
    fi
    command=(resume "$out")
else
    command=(run "$case" --out "$out")
    if [ -n "${SLURM_JOB_ID:-}" ] && same && [ "$(head -n 1 "$note")" = "$this" ]; then
        # What this job has left where it died before its first checkpoint.
        command+=(--overwrite)
    elif [ ! -e "$out/series.csv" ] && [ ! -e "$out/summary.json" ]; then
        # Beside results of another run there is no note, and turbid refuses to replace them.
        mkdir -p "$out" && { echo "$this"; cat "$case"; } >"$note.new" && mv "$note.new" "$note" || exit 2
    fi
fi
# Processes of MPI have one thread each.
[ "${SLURM_NTASKS:-1}" -gt 1 ] || command+=(--threads "${SLURM_CPUS_PER_TASK:-0}")
if [ -n "${SLURM_JOB_END_TIME:-}" ]; then
    left=$((SLURM_JOB_END_TIME - $(date +%s) - 300))
    [ "$left" -le 0 ] || command+=(--max-walltime "$left")
fi

# The signal before the limit comes here and goes on to the program, which then writes a checkpoint. TURBID may be several words.
srun ${TURBID:-turbid} "${command[@]}" --quiet &
job=$!
interrupted=
trap 'interrupted=yes; kill -TERM "$job" 2>/dev/null' TERM
wait "$job"
code=$?
# An interrupted wait returns the code of the signal; one more returns that of the program, also if it has ended.
while [ "$interrupted" ]; do
    interrupted=
    wait "$job"
    code=$?
done

if [ "$code" -eq 4 ]; then
    if ! saved; then
        echo "error: stopped before the first checkpoint; give the job more time (--time)" >&2
    elif scontrol requeue "$SLURM_JOB_ID"; then
        exit 0
    fi
fi
exit "$code"
