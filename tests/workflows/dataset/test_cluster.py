"""A dataset made on a real SLURM or Ray cluster has the stores, arrays and labels of one process,
even if processes or nodes of the cluster are killed.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from contextlib import suppress

import numpy as np
import pytest
from isethdr_workflows.dataset.workers import SLURM, Workers, share

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage import store

from .. import slurm_cluster
from ..command import environment, isethdr, leftovers, start, stores
from .small_world import installed

KILLS = 5
KILLS_OF_A_START = 2
MOST_STARTS = 8
RECIPE = """
about: A panel over a road.
families:
  plain:
    overrides: [scene=small_world, scene.fails=false, renderer=small, renderer.seconds=2]
    draw: {scene.intensity_cd: {uniform: [200, 900]}}
"""


def ended(process: subprocess.Popen, variables: dict[str, str], kills: int) -> int:
    """Kill up to `kills` randomly chosen processes of jobs until the command ends, and return how
    many were killed.
    """
    chosen = random.Random()
    killed = 0
    while process.poll() is None:
        time.sleep(chosen.uniform(1.0, 8.0))
        running = slurm_cluster.workers(variables)
        if running and killed < kills:
            with suppress(ProcessLookupError):  # it ended by itself meanwhile
                os.kill(chosen.choice(running), signal.SIGKILL)
                killed += 1
    return killed


def check_equal(one, other):
    """Compare the stores and records of two homes, 24 scenes each."""
    expected = stores(one)
    assert len(expected) == 24
    assert stores(other).keys() == expected.keys() and not leftovers(other)
    for name in expected:
        first, second = (store.open_store(home / "scenes" / name) for home in (one, other))
        for variable in first.data_vars:
            assert np.array_equal(first[variable].values, second[variable].values), variable
        assert first.attrs["objects"] == second.attrs["objects"]
    records = [
        [json.loads(path.read_text()) for path in sorted((home / "datasets").rglob("0*.json"))]
        for home in (one, other)
    ]
    assert [r["stores"] for r in records[0]] == [r["stores"] for r in records[1]]


@pytest.mark.slow
def test_a_dataset_on_ray_survives_a_lost_node(tmp_path, monkeypatch):
    """Three local nodes, of which one is removed once the first scenes are stored."""
    pytest.importorskip("ray", reason="type pip install 'isethdr[ray]'")
    from ray.cluster_utils import Cluster

    plugins = [installed(tmp_path / "plugin")]
    recipe = tmp_path / "small.yaml"
    recipe.write_text(RECIPE)
    command = ("dataset", "generate", "small", "count=24", "seed=3", f"recipe={recipe}")
    homes = {name: tmp_path / name for name in ("one", "cluster")}
    for name, value in environment(plugins, {}).items():  # the nodes' processes inherit it
        monkeypatch.setenv(name, value)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
        cluster.wait_for_nodes()
        variables = {"ISETHDR_HOME": str(homes["cluster"]), "RAY_ADDRESS": cluster.address}
        process = start(*command, "engine=ray", "workers=6", plugins=plugins, **variables)
        while len(stores(homes["cluster"])) < 6:
            assert process.poll() is None, process.communicate()
            time.sleep(0.2)
        cluster.remove_node(nodes[0], allow_graceful=False)
        _, err = process.communicate()
        assert process.returncode == 0, err
    finally:
        cluster.shutdown()
    done = isethdr(*command, plugins=plugins, ISETHDR_HOME=str(homes["one"]))
    assert done.returncode == 0, done.stderr
    check_equal(homes["one"], homes["cluster"])


@pytest.mark.slow
@pytest.mark.skipif(
    bool(slurm_cluster.missing()),
    reason=f"SLURM lacks {', '.join(slurm_cluster.missing())}; type apt-get install slurm-wlm",
)
def test_a_dataset_on_slurm_survives_killed_processes(tmp_path):
    """Processes are killed at random times; the 24 scenes are the same in the end."""
    pytest.importorskip("submitit", reason="type pip install 'isethdr[slurm]'")
    plugins = [installed(tmp_path / "plugin")]
    recipe = tmp_path / "small.yaml"
    recipe.write_text(RECIPE)
    command = ("dataset", "generate", "small", "count=24", "seed=3", f"recipe={recipe}")
    homes = {name: tmp_path / name for name in ("one", "cluster")}
    kills = KILLS
    codes = []
    with slurm_cluster.cluster(tmp_path / "slurm") as variables:
        while not codes or (codes[-1] != 0 and len(codes) < MOST_STARTS):
            slurm = ("engine=slurm", "workers=4", "hours=1")
            variables |= {"ISETHDR_HOME": str(homes["cluster"])}
            process = start(*command, *slurm, plugins=plugins, **variables)
            kills -= ended(process, variables, min(kills, KILLS_OF_A_START))
            _, err = process.communicate()
            codes.append(process.returncode)
            assert codes[-1] == 0 or "type the same command again to continue" in err, err
            assert slurm_cluster.stop_jobs(variables)
            made = len(stores(homes["cluster"]))
            print(f"start {len(codes)}: exit code {codes[-1]}, {made} stores")
    assert codes[-1] == 0, err
    assert kills == 0 and len(codes) > 1, "no process was killed"

    done = isethdr(*command, plugins=plugins, ISETHDR_HOME=str(homes["one"]))
    assert done.returncode == 0, done.stderr
    check_equal(homes["one"], homes["cluster"])


def test_jobs_that_ended_early_are_one_error_after_all_others_were_waited_for(
    isethdr_home, monkeypatch
):
    """The jobs are stand-ins that report a killed job as submitit does."""
    pytest.importorskip("submitit", reason="type pip install 'isethdr[slurm]'")
    import submitit

    waited = []

    class Job:
        def __init__(self, chunk):
            self.chunk = chunk

        def exception(self):
            waited.append(self.chunk)
            return RuntimeError("Job 3 was killed\nand more") if 0 in self.chunk else None

    class Executor:
        def __init__(self, folder, cluster):
            assert cluster == "slurm"

        def update_parameters(self, **parameters):
            assert parameters.get("cpus_per_task", 4) == 4

        def map_array(self, call, chunks):
            return [Job(chunk) for chunk in chunks]

    monkeypatch.setattr(submitit, "AutoExecutor", Executor)
    with pytest.raises(CatalogError, match="1 of 2 jobs, for example Job 3 was killed; .*again"):
        share(print, range(5), Workers(SLURM, count=2, cpus=4), "night", print)
    assert waited == [[0, 2, 4], [1, 3]]


def test_workers_that_cannot_work_are_refused():
    with pytest.raises(ConfigError, match="cpus is 0"):
        Workers(cpus=0)
