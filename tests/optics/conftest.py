"""Fixtures of tests of optics."""

import pytest
import yaml

from .lamp_ghosts import SINGLET


@pytest.fixture
def bare(tmp_path):
    """Return the path of a prescription of one bare lens."""
    path = tmp_path / "bare.yaml"
    path.write_text(yaml.safe_dump(SINGLET))
    return str(path)
