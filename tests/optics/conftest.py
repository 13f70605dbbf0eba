"""Fixtures of tests of optics."""

import pytest
import yaml
from isethdr_optics.plan import planning

from .lamp_ghosts import SINGLET


@pytest.fixture(autouse=True)
def small_frames_go_the_way_of_large_ones(monkeypatch):
    """Let lenses try the photocurrent path on frames of any size, also very small ones."""
    monkeypatch.setattr(planning, "WORTH", 0)


@pytest.fixture
def bare(tmp_path):
    """Return the path of a prescription of one bare lens."""
    path = tmp_path / "bare.yaml"
    path.write_text(yaml.safe_dump(SINGLET))
    return str(path)
