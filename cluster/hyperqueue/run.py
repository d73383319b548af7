"""A campaign as tasks of HyperQueue: python cluster/hyperqueue/run.py FILE [PROGRAM]     (pip install hyperqueue)

A server that runs (`hq server start` on a cluster) gets the tasks; without one, a server and a worker are started on this machine. A task whose
worker is lost is begun again and goes on where the shard was.
"""

import subprocess
import sys
import tempfile

from hyperqueue import Client, Job
from hyperqueue.cluster import LocalCluster, WorkerConfig

# A shard with flights that failed is complete.
SHARD = '"$0" campaign "$1" --shard "$2"; status=$?; [ $status -eq 6 ] || exit $status'


def fly(client, file, program, shards):
    job = Job(max_fails=0)
    for shard in range(shards):
        job.program(["bash", "-c", SHARD, program, file, str(shard)], stdout=None, stderr=None, crash_limit=3)
    client.wait_for_jobs([client.submit(job)])


def main():
    file, program = sys.argv[1], (sys.argv[2:] or ["apsides"])[0]
    shards = int(subprocess.check_output([program, "campaign", file, "--shards"], text=True))
    try:
        running = Client()
    except Exception:  # The package has no narrower one for a server that is not there.
        running = None
    if running:
        fly(running, file, program, shards)
    else:
        with tempfile.TemporaryDirectory() as place, LocalCluster(place, WorkerConfig()) as cluster:
            fly(cluster.client(), file, program, shards)
    sys.exit(subprocess.call([program, "campaign", file, "--merge"]))


if __name__ == "__main__":
    main()
