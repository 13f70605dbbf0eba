"""The benchmark of a shot stays below its limit of memory, and gives the same bits in every
process. Its ratio of CPU times is not tested, because it needs a quiet machine.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_shot_keeps_to_its_memory_and_its_bits():
    script = Path(__file__).parents[2] / "benchmarks" / "shot.py"
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False
    )
    peak = re.search(r"peak (\d+) MB with the input \(target (\d+)\)", done.stdout)
    assert peak and int(peak[1]) <= int(peak[2]) and "the same bits" in done.stdout, (
        done.stdout + done.stderr
    )
