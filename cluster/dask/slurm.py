"""A campaign as tasks of Dask whose workers are jobs of Slurm: python cluster/dask/slurm.py FILE [JOBS]     (pip install dask-jobqueue)

APSIDES (apsides) names the program. Other queues (PBS, LSF, SGE, HTCondor) have a class of their own in dask_jobqueue.
"""

import os
import subprocess
import sys
from pathlib import Path

from dask_jobqueue import SLURMCluster

HERE = Path(__file__).resolve().parent


def main():
    file, jobs = sys.argv[1], int((sys.argv[2:] or ["4"])[0])
    # Of a job. A worker that starts the program needs little memory of its own.
    worker = {"cores": 1, "processes": 1, "memory": "1GB", "walltime": "01:00:00"}
    logs = str(Path(file).resolve().with_suffix("") / "log")
    with SLURMCluster(**worker, job_directives_skip=["--mem"], log_directory=logs) as cluster:
        cluster.scale(jobs=jobs)
        run = [HERE / "run.sh", file, "--scheduler", cluster.scheduler_address]
        sys.exit(subprocess.call(run, env={**os.environ, "PYTHON": sys.executable}))


if __name__ == "__main__":
    main()
