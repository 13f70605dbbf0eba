"""Flare of aperture blades and dirt: the lights, the figures of a cell, the sheet, and the order of
the table.
"""

import numpy as np
import pytest
from isethdr_workflows.paper import fig4 as study

from isethdr_core.errors import ConfigError


def test_lights_step_down_by_ten():
    from isethdr_core.physics.photometry import luminance

    mixed = study.lights(120, 40)
    y = luminance(mixed.values, mixed.wavelength.values)[18:22]
    peaks = [y[:, k * 24 : (k + 1) * 24].max() for k in range(5)]
    # 1e-3: float32, and the ground of 1e-3 cd/m2
    np.testing.assert_allclose(peaks, 1e6 * 10.0 ** -np.arange(5), rtol=1e-3)


def test_figures_count_the_discs_that_stand_out():
    lux = np.ones((40, 120))
    # the last disc has less than twice the light around it
    for k, level in enumerate((1e4, 1e3, 100.0, 10.0, 1.2)):
        lux[18:22, 24 * k + 10 : 24 * k + 15] = level
    got = study.figures(lux)
    assert got == {"lux_peak": 1e4, "lux_median": 1.0, "decades": 4.0, "discs_seen": 4}


def test_sheet(tmp_path):
    from PIL import Image

    count = len(study.BLADES) * len(study.DIRT)
    study.write_sheet(str(tmp_path / "a.png"), [np.full((6, 9), 10.0**-k) for k in range(count)])
    sheet = np.asarray(Image.open(tmp_path / "a.png"))
    assert sheet.shape == (4 * 9 - 3, 5 * 12 - 3, 3)
    # each cell is a decade darker than the one before
    assert sheet[0, 0].sum() > sheet[0, 12].sum() > sheet[0, 24].sum()
    assert (sheet[6:9] == 255).all()


@pytest.mark.parametrize("size", [{"width": 99}, {"height": 15}])
def test_a_cell_without_room_for_the_rings_is_refused(size):
    with pytest.raises(ConfigError, match="expected at least 100 x 16 tiles"):
        study.paper_fig4(**size)


@pytest.mark.slow
def test_dirt_takes_light_and_fills_the_dark():
    rows = study.paper_fig4(width=120, height=67)
    for blades in {r["blades"] for r in rows}:
        column = [r for r in rows if r["blades"] == blades]  # from dense dirt to none
        assert np.all(np.diff([r["transmitted"] for r in column]) > 0)
        assert np.all(np.diff([r["lux_median"] for r in column]) < 0)
