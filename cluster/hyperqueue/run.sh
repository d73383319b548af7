#!/usr/bin/env bash
# A campaign as an array of HyperQueue: cluster/hyperqueue/run.sh FILE
#
# Without a server (`hq server info`) one is started with a worker on this machine, and ended behind the work. APSIDES names the program.
set -euo pipefail
file=$(realpath "$1")
program=$(command -v "${APSIDES:-apsides}")
if ! hq server info >/dev/null 2>&1; then
    hq server start >/dev/null 2>&1 &
    trap 'hq server stop' EXIT
    for _ in $(seq 100); do hq server info >/dev/null 2>&1 && break; sleep 0.1; done
    hq worker start >/dev/null 2>&1 &
fi
last=$(($("$program" campaign "$file" --shards) - 1))
# A shard with flights that failed is complete; a task whose worker is gone is begun again by HyperQueue.
hq submit --wait --array "0-$last" --stdout none --crash-limit 3 -- \
    bash -c "'$program' campaign '$file' --shard \$HQ_TASK_ID; status=\$?; [ \$status -eq 6 ] || exit \$status"
"$program" campaign "$file" --merge
