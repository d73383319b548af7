"""A campaign as tasks of Ray: python cluster/ray/run.py FILE [PROGRAM]     (pip install ray)

Without a cluster (RAY_ADDRESS) one is started on this machine. A task whose worker dies is tried again and goes on where the shard was.
"""

import subprocess
import sys

import ray

# All flights are there; some of them have no result.
COMPLETE = (0, 6)


@ray.remote(num_cpus=1, max_retries=3, retry_exceptions=True)
def fly(program, file, shard):
    done = subprocess.run([program, "campaign", file, "--shard", str(shard)], capture_output=True, text=True)
    if done.returncode not in COMPLETE:
        raise RuntimeError(f"shard {shard} ended with status {done.returncode}: {done.stderr.strip()}")


def main():
    file, program = sys.argv[1], (sys.argv[2:] or ["apsides"])[0]
    shards = int(subprocess.check_output([program, "campaign", file, "--shards"], text=True))
    ray.init(include_dashboard=False)
    ray.get([fly.remote(program, file, shard) for shard in range(shards)])
    sys.exit(subprocess.call([program, "campaign", file, "--merge"]))


if __name__ == "__main__":
    main()
