"""The folder of all that is stored."""

from __future__ import annotations

import os
from pathlib import Path


def home() -> Path:
    """Return the folder that holds `scenes/` and `runs/`: the variable ISETHDR_HOME, or ./runs."""
    return Path(os.environ.get("ISETHDR_HOME") or "runs")
