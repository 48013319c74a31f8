#!/usr/bin/env python3
"""A sweep on a Dask cluster (docs/sweep.md): a shard a task, any number of workers, one folder that all of them see.

    python3 sweep_dask.py plan.toml FOLDER --workers 2                   # workers on this machine
    python3 sweep_dask.py plan.toml FOLDER --scheduler tcp://HOST:8786   # a cluster that is there

It needs dask and distributed. A worker that dies costs the rows under way: another does its shard again.
"""

import argparse
import subprocess

from dask.distributed import Client, LocalCluster


def sweep(mmt, *words):
    """Runs `mmt sweep`; what it printed."""
    done = subprocess.run([mmt, "sweep", *words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout.strip()


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("plan")
    arguments.add_argument("folder")
    arguments.add_argument("--scheduler", help="address of a scheduler; without it workers are started here")
    arguments.add_argument("--workers", type=int, default=2, help="how many, where they are started here")
    arguments.add_argument("--shards", type=int, default=8, help="tasks; more than workers, so that all end at about the same time")
    arguments.add_argument("--mmt", default="mmt", help="the program, as the workers find it")
    options = arguments.parse_args()
    cluster = options.scheduler or LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
    plan = [options.plan, "--out", options.folder]
    with Client(cluster) as client:
        shards = [f"{number}/{options.shards}" for number in range(1, options.shards + 1)]
        # not pure: a shard that is done again has other rows to do
        tasks = [client.submit(sweep, options.mmt, *plan, "--shard", shard, "--jobs", "1", pure=False) for shard in shards]
        client.gather(tasks)
    print(sweep(options.mmt, *plan, "--merge"))


if __name__ == "__main__":
    main()
