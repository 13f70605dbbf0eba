"""A sweep on a real SLURM cluster gives the same stores as one process, even if its processes are
killed at random.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from isethdr_core.config import hydra_app
from isethdr_core.results.stored import open_run

from . import slurm_cluster
from .command import LIGHTS, here, isethdr, leftovers, start, stores

KILLS = 5
KILLS_OF_A_START = 2
MOST_STARTS = 8
METRICS = ("shares", "dynamic_range", "snr", "colour", "ssim", "contrast", "detection")
SWEEP = [
    "run",
    "-m",
    "name=cluster",
    "experiment=own_picture",
    "scene.unit=cd/m2",
    "scene.horizontal_field_deg=2",
    "lens=ideal",
    "~flare.dirt",
    "sensor=bayer",
    "isp=linear",
    "draws=1",
    *(f"~metric.{name}" for name in METRICS),
    "sensor.exposure_s=0.004,0.016",
    "seed=1,2,3,4,5,6,7,8,9,10,11,12",
]
SLURM = ["hydra/launcher=submitit_slurm", "hydra.launcher.array_parallelism=2"]


def test_a_launcher_that_fails_is_one_line(isethdr_home, monkeypatch, capsys):
    """The launcher fails as that of submitit does without a cluster or after a killed job."""

    def broken(**_):
        def raising():
            raise RuntimeError("Could not detect a cluster\nand more lines")

        return lambda _: raising

    monkeypatch.setattr(hydra_app.hydra, "main", broken)
    code, said = here(monkeypatch, capsys, "run", "-m", *LIGHTS, "lighting=ideal", "seed=1,2")
    assert code == 1
    assert said == (
        "error: the launcher of the sweep stopped (RuntimeError: Could not detect a cluster);"
        " stored results are complete; type the same command again to continue\n"
    )


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


def check_equal(one: Path, other: Path, runs: int) -> None:
    """Compare the stores of two homes: names, all scores, and the captures to the last bit."""
    assert stores(other).keys() == stores(one).keys() and not leftovers(other)
    names = sorted(path.name for path in (one / "runs").glob("*.zarr"))
    assert len(names) == runs
    for name in names:
        first, second = (
            json.loads((home / "runs" / name / "zarr.json").read_text()) for home in (one, other)
        )
        assert first["attributes"]["scores"] == second["attributes"]["scores"]
        first, second = (
            open_run(home / "runs" / name).open("captures/bayer") for home in (one, other)
        )
        assert np.array_equal(first["raw"].values, second["raw"].values)


needs_slurm = pytest.mark.skipif(
    bool(slurm_cluster.missing()),
    reason=f"SLURM lacks {', '.join(slurm_cluster.missing())}; type apt-get install slurm-wlm",
)


@pytest.mark.slow
@needs_slurm
def test_a_sweep_on_slurm_survives_killed_processes(isethdr_home, tmp_path, monkeypatch):
    """Processes are killed at random times; the stores are the same in the end."""
    pytest.importorskip("submitit", reason="type pip install 'isethdr[slurm]'")
    image = np.geomspace(1, 1000, 8 * 12 * 3, dtype=np.float32).reshape(8, 12, 3)
    np.save(tmp_path / "image.npy", image)
    sweep = [*SWEEP, f"scene.path={tmp_path / 'image.npy'}"]
    there = tmp_path / "cluster_home"
    kills = KILLS
    codes = []
    with slurm_cluster.cluster(tmp_path / "slurm") as variables:
        while not codes or (codes[-1] != 0 and len(codes) < MOST_STARTS):
            process = start(*sweep, *SLURM, ISETHDR_HOME=str(there), **variables)
            kills -= ended(process, variables, min(kills, KILLS_OF_A_START))
            out, err = process.communicate()
            codes.append(process.returncode)
            assert codes[-1] == 0 or "type the same command again to continue" in err, err
            assert slurm_cluster.stop_jobs(variables)  # jobs that the launcher left
            print(f"start {len(codes)}: exit code {codes[-1]}, {len(stores(there))} stores")
    assert codes[-1] == 0, err
    assert kills == 0 and len(codes) > 1, "no process was killed"
    assert "24 computed" in out or "stored before" in out

    done = isethdr(*sweep)  # in one process
    assert done.returncode == 0, done.stderr
    check_equal(isethdr_home, there, runs=24)


@pytest.mark.slow
@needs_slurm
@pytest.mark.parametrize(("runs", "workers", "kills"), [(6, 2, 1), (200, 20, 0)])
def test_chunks_on_slurm_store_what_one_process_stores(
    isethdr_home, tmp_path, runs, workers, kills
):
    """In the first case, one of two chunks is killed, and the same command computes the missing
    runs. In the second case, 200 runs are one array of 20 chunks.
    """
    pytest.importorskip("submitit", reason="type pip install 'isethdr[slurm]'")
    image = np.geomspace(1, 1000, 8 * 12 * 3, dtype=np.float32).reshape(8, 12, 3)
    np.save(tmp_path / "image.npy", image)
    small = [text for text in SWEEP if not text.startswith(("seed", "sensor.exposure"))]
    sweep = [*small, f"scene.path={tmp_path / 'image.npy'}", f"seed=range(1,{runs + 1})"]
    there = tmp_path / "cluster_home"
    chunks = ["hydra/launcher=slurm_chunks", f"hydra.launcher.workers={workers}"]
    with slurm_cluster.cluster(tmp_path / "slurm") as variables:
        if kills:
            process = start(*sweep, *chunks, ISETHDR_HOME=str(there), **variables)
            assert ended(process, variables, kills) == kills
            _, err = process.communicate()
            assert process.returncode == 1, err
            assert f"1 of {workers} chunks ended early" in err, err
            assert "type the same command again" in err, err
            assert slurm_cluster.stop_jobs(variables)
        process = start(*sweep, *chunks, ISETHDR_HOME=str(there), **variables)
        _, err = process.communicate()
        assert process.returncode == 0, err
    returned = [path.name for path in there.glob("sweeps/cluster/.chunks/*_result.pkl")]
    arrays = [name.partition("_")[0] for name in returned]
    assert max(arrays.count(array) for array in arrays) == workers  # tasks of one array
    process = start(*sweep)  # in one process, which may take more than ten minutes
    _, err = process.communicate()
    assert process.returncode == 0, err
    check_equal(isethdr_home, there, runs)
