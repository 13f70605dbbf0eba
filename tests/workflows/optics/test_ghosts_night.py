"""Ghosts of a night drive: figures of a lamp off the axis, from the same code as the study."""

import numpy as np
import pytest
from isethdr_workflows.ghosts_night import study

from isethdr_core.quantities import RADIANCE, centres, plane


@pytest.mark.slow
def test_coatings_take_the_ghosts_away(tmp_path):
    values = np.full((3, 36, 48), 1e-6, np.float32)
    values[:, 17:19, 36] = 1.0
    mixed = plane(values, [450.0, 550.0, 650.0], centres(48, 0.48), centres(36, 0.36), RADIANCE)
    path = tmp_path / "ghosts.png"
    bare, single, multi = study(mixed, str(path))
    assert path.stat().st_size > 5000
    assert bare["added"] > 5 * single["added"] > 10 * multi["added"] > 0
    assert multi["strongest_pair"] < 1e-4 and 0.1 < bare["opposite"] < 0.9
