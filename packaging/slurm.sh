#!/bin/bash
# A run of any length as a Slurm job: it stops with a checkpoint before the time limit, is queued again, and resumes, until the case
# is complete.
#
#   sbatch packaging/slurm.sh CASE.toml [DIR]         results in DIR, by default out/CASE
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

if saved; then
    command=(resume "$out")
else
    command=(run "$case" --out "$out")
    # What a job that died before its first checkpoint has left; results of another run are refused.
    [ "${SLURM_RESTART_COUNT:-0}" -eq 0 ] || command+=(--overwrite)
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
trap 'kill -TERM "$job" 2>/dev/null' TERM
wait "$job"
code=$?
while kill -0 "$job" 2>/dev/null; do
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
