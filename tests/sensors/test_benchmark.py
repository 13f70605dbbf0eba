"""The benchmark of a shot meets its targets: CPU time, memory, the same bits in every process."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_shot_meets_its_targets():
    script = Path(__file__).parents[2] / "benchmarks" / "shot.py"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "the same bits" in done.stdout, done.stdout + done.stderr
