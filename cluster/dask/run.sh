#!/usr/bin/env bash
# A campaign as tasks of Dask on this machine, or of a scheduler: cluster/dask/run.sh FILE [--workers N] [--scheduler ADDRESS]
#
# Needs `pip install distributed`. APSIDES (apsides) names the program, PYTHON (python3) the interpreter. On a cluster whose workers are jobs,
# dask-jobqueue starts them: see README.md beside this file.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
file=$(realpath "$1") && shift
program=$(command -v "${APSIDES:-apsides}")
list=$(mktemp)
trap 'rm -f "$list"' EXIT
seq 0 "$(($("$program" campaign "$file" --shards) - 1))" >"$list"
"${PYTHON:-python3}" "$here/shards_dask.py" "$program" "$file" "$list" "$@"
exec "$program" campaign "$file" --merge
