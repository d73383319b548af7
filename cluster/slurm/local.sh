#!/usr/bin/env bash
# A Slurm cluster of four nodes on this machine, of Debian's packages slurm-wlm and munge; no systemd, no root needed.
#
#   cluster/slurm/local.sh start [DIR]   starts it; DIR (a new temporary folder without it) has configuration, state and logs
#   . DIR/env                            makes sbatch, squeue, scontrol and sinfo talk to it
#   cluster/slurm/local.sh stop DIR      ends its daemons
#   cluster/slurm/local.sh run CMD ..    starts it, runs a command with it, ends it
#
# NODES (4), CPUS of a node (1) and PORT (17000, and those behind it) may be set before.
set -euo pipefail

nodes=${NODES:-4} cpus=${CPUS:-1} port=${PORT:-17000}

die() { echo "local.sh: $*" >&2; exit 1; }

need() {
    local missing=()
    for tool in munged slurmctld slurmd sbatch squeue scontrol; do
        PATH=$PATH:/usr/sbin command -v "$tool" >/dev/null || missing+=("$tool")
    done
    [ ${#missing[@]} -eq 0 ] || die "no ${missing[*]}: apt-get install slurm-wlm munge"
}

start() {
    need
    local dir=$1 user host
    user=$(id -un) host=$(hostname -s)
    PATH=$PATH:/usr/sbin
    mkdir -p "$dir"/{state,log,munge}
    dir=$(cd "$dir" && pwd)
    # Munge wants folders that nobody else writes into.
    chmod 700 "$dir/munge"
    head -c 1024 /dev/urandom >"$dir/munge/key"
    chmod 600 "$dir/munge/key"
    cat >"$dir/slurm.conf" <<CONF
ClusterName=apsides
SlurmctldHost=$host(localhost)
SlurmctldPort=$port
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmctldPidFile=$dir/slurmctld.pid
SlurmctldLogFile=$dir/log/slurmctld
SlurmdPidFile=$dir/slurmd-%n.pid
SlurmdLogFile=$dir/log/slurmd-%n
SlurmdSpoolDir=$dir/state/%n
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SlurmctldTimeout=10
SlurmdTimeout=10
InactiveLimit=0
KillWait=5
MinJobAge=300
MaxArraySize=10001
MaxJobCount=20000
JobRequeue=1
ReturnToService=2
MailProg=/bin/true
NodeName=node[1-$nodes] NodeHostname=$host NodeAddr=localhost Port=[$((port + 1))-$((port + nodes))] CPUs=$cpus
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    printf 'export SLURM_CONF=%q\n' "$dir/slurm.conf" >"$dir/env"
    # shellcheck disable=SC1091
    . "$dir/env"
    munged --key-file="$dir/munge/key" --socket="$dir/munge/socket" --pid-file="$dir/munge/pid" \
        --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" --force 2>>"$dir/log/munged"
    slurmctld -f "$dir/slurm.conf" >>"$dir/log/start" 2>&1
    for k in $(seq "$nodes"); do
        mkdir -p "$dir/state/node$k"
        slurmd -f "$dir/slurm.conf" -N "node$k" >>"$dir/log/start" 2>&1
    done
    for _ in $(seq 100); do
        [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = "$nodes" ] && break
        sleep 0.1
    done
    [ "$(sinfo -h -t idle -o %D)" = "$nodes" ] || { sinfo >&2; die "the nodes did not come up, see $dir/log"; }
    echo "$dir"
}

stop() {
    local dir=$1 file pid
    [ -f "$dir/slurm.conf" ] || die "$dir: no cluster of local.sh"
    for file in "$dir"/slurmd-*.pid "$dir/slurmctld.pid" "$dir/munge/pid"; do
        [ -f "$file" ] || continue
        pid=$(cat "$file")
        kill "$pid" 2>/dev/null || continue
        for _ in $(seq 50); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    done
}

case ${1:-} in
start) start "${2:-$(mktemp -d)}" ;;
stop) [ $# -eq 2 ] || die "stop takes the folder"; stop "$2" ;;
run)
    shift
    dir=$(mktemp -d)
    trap 'stop "$dir"; rm -rf "$dir"' EXIT
    start "$dir" >/dev/null
    SLURM_CONF=$dir/slurm.conf "$@"
    ;;
*) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
