"""Shards of a campaign as tasks of Dask: python shards_dask.py PROGRAM FILE SHARDS [--scheduler ADDRESS]

SHARDS is a file with a number a line. Without a scheduler a cluster is started on this machine. A task whose worker is killed is given to
another one and goes on where the shard was.
"""

import argparse
import subprocess
import sys

# All flights are there; some of them have no result.
COMPLETE = (0, 6)
BAD_INPUT = 2


def fly(program, file, shard):
    """Computes a shard, and returns its status."""
    done = subprocess.run(
        [program, "campaign", file, "--shard", str(shard)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    if done.returncode in COMPLETE or done.returncode == BAD_INPUT:
        return done.returncode, done.stderr
    raise RuntimeError(f"shard {shard} ended with status {done.returncode}: {done.stderr.strip()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("file")
    parser.add_argument("shards")
    parser.add_argument("--scheduler")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--attempts", type=int, default=3)
    a = parser.parse_args()
    try:
        import dask
        from dask.distributed import Client, LocalCluster, as_completed
    except ImportError as missing:
        sys.exit(f"{missing}: pip install distributed")
    with open(a.shards, encoding="utf-8") as lines:
        shards = [int(line) for line in lines]
    # Shards are long: what looks at workers ten or a hundred times a second takes their time.
    dask.config.set(
        {
            "distributed.worker.profile.enabled": False,
            "distributed.worker.memory.monitor-interval": "2s",
            "distributed.admin.tick.interval": "1s",
            "distributed.admin.system-monitor.interval": "5s",
        }
    )
    cluster = a.scheduler or LocalCluster(n_workers=a.workers, threads_per_worker=1, dashboard_address=None)
    with Client(cluster) as client:
        tasks = [client.submit(fly, a.program, a.file, shard, pure=False, retries=a.attempts - 1) for shard in shards]
        for task in as_completed(tasks):
            status, words = task.result()
            if status == BAD_INPUT:
                sys.exit(words.strip())
    if not a.scheduler:
        cluster.close()


if __name__ == "__main__":
    main()
