"""A training that is killed continues to the same weights as one that is not killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

torch = pytest.importorskip("torch", reason="the extra train is not installed")

CALL = "from isethdr_core.cli.commands import main; main()"
SETTINGS = "sensor=bayer steps=24 pictures=3 picture_px=48 patch_px=48 batch=2 checks=8".split()
KILLS = 3
LIMIT_S = 600


def start(home, name):
    """Start a training in a process of its own."""
    arguments = ["train", "picture", *SETTINGS, f"name={name}", "threads=1"]
    return subprocess.Popen(
        [sys.executable, "-c", CALL, *arguments],
        env={**os.environ, "ISETHDR_HOME": str(home)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def stamp(path):
    """Return the time at which a file was last replaced, ns; 0 if there is no file."""
    return path.stat().st_mtime_ns if path.exists() else 0


@pytest.mark.slow
def test_a_killed_training_ends_with_the_same_weights(tmp_path):
    whole = start(tmp_path, "whole")
    said, _ = whole.communicate(timeout=LIMIT_S)
    assert whole.returncode == 0, said
    state = tmp_path / "training" / "pictures" / "parts" / "state.pt"
    kills = 0
    while kills < KILLS:
        before = stamp(state)
        process = start(tmp_path, "parts")
        end = time.monotonic() + LIMIT_S
        while stamp(state) == before and process.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        # the kill falls between this state and the next one, or while the next one is written
        time.sleep(0.15 * kills)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        kills += 1
        torch.load(state, weights_only=True)  # the old state or the new one, never half of one
    last = start(tmp_path, "parts")
    said, _ = last.communicate(timeout=LIMIT_S)
    assert last.returncode == 0 and "continues after step" in said, said
    expected, got = (
        torch.load(state.parents[1] / name / "state.pt", weights_only=True)["weights"]
        for name in ("whole", "parts")
    )
    for name, value in expected.items():
        assert torch.equal(value, got[name]), name
    assert not [path for path in state.parent.iterdir() if path.suffix == ".tmp"]
