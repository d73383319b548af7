#!/usr/bin/env bash
# A campaign as an array job of Slurm, and a job behind it that joins the shards: cluster/slurm/run.sh FILE [OPTIONS OF SBATCH]
#
# As `engine = "slurm"` in the file does, without a pilot that follows. APSIDES (apsides) names the program, TASKS (100) the most tasks.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
file=$(realpath "$1") && shift
program=$(command -v "${APSIDES:-apsides}")
shards=$("$program" campaign "$file" --shards)
tasks=$((shards < ${TASKS:-100} ? shards : ${TASKS:-100}))
job=$(sbatch --parsable --requeue --open-mode=append --array="0-$((tasks - 1))" "$@" \
    "$here/shard.sbatch" "$program" "$file" "$tasks" 3)
merge=$(sbatch --parsable --kill-on-invalid-dep=yes --dependency="afterok:${job%%;*}" "$@" \
    --wrap "exec '$program' campaign '$file' --merge")
echo "shards: job $job, $tasks tasks of $shards shards; merge: job $merge"
