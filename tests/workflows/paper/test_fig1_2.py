"""Figures 1 and 2: shares of light groups add up; a narrowed beam keeps its flux."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_workflows.paper import fig1, fig2
from isethdr_workflows.paper.parameters import chosen

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build


@pytest.mark.parametrize("half_angle_deg", [90.0, 45.0, 22.5, 15.0, 7.5, 5.0])
def test_a_narrowed_beam_has_the_flux_of_the_lambertian_light(half_angle_deg):
    """The flux is a sum over 2000 rings by the midpoint rule. Where a beam ends in a kink, this is
    right to 1e-5.
    """
    assert fig2.flux_lm(half_angle_deg) == pytest.approx(fig2.FLUX_LM, rel=1e-5)
    assert fig2.beam_cd(half_angle_deg + 0.01, half_angle_deg) == 0


def test_gains_on_the_axis_are_those_of_the_closed_form():
    """The gains are 394, 43.6, 19.3 and 4.66 times the Lambertian light at 5, 15, 22.5 and 45
    degrees. They were computed independently of this code, to three digits.
    """
    lambertian = fig2.beam_cd(0.0, 90.0)
    assert lambertian == pytest.approx(fig2.FLUX_LM / np.pi)
    for angle, gain in ((5.0, 394), (15.0, 43.6), (22.5, 19.3), (45.0, 4.66)):
        assert fig2.beam_cd(0.0, angle) / lambertian == pytest.approx(gain, rel=4e-3)


def test_the_road_has_the_illuminance_of_the_photometric_law():
    """Straight ahead the illuminance is I h / d^3. The dipped beam reaches farther on its own side,
    the right one. Narrower beams reach farther.
    """
    x, y = fig2.road()
    lux = fig2.illuminance(lambda a: np.full_like(a, 100.0), x, y)
    row = int(np.argmin(np.abs(y)))
    distance = np.sqrt(x[40] ** 2 + y[row, 0] ** 2 + fig2.HEIGHT_M**2)
    assert lux[row, 40] == pytest.approx(100 * fig2.HEIGHT_M / distance**3)
    dipped = fig2.dipped(x, y)
    far = int(np.searchsorted(x, 60.0))
    assert dipped[y[:, 0] < 0, far].sum() > 2 * dipped[y[:, 0] > 0, far].sum()
    rows = fig2.paper_fig2()
    reach = [one["reach_1_lux_m"] for one in rows[:5]]
    assert reach == sorted(reach) and reach[-1] > 4 * reach[0]


@pytest.fixture
def lamps(monkeypatch):
    """Give figure 1 five lamps in place of a rendering."""
    chart = build(
        "scene",
        "point_lights",
        width=40,
        height=24,
        disc_diameter_deg=4,
        first_nm=450,
        last_nm=650,
        step_nm=50,
    )

    class Night:
        lighting = build("lighting", "weights", weights={"sky": 1e-3, "headlights": 1.0})

    class Day:
        lighting = build("lighting", "weights", weights={"sky": 1e3, "headlights": 1.0})

    monkeypatch.setattr(fig1, "rendered", lambda *_: (Night(), chart()))
    monkeypatch.setattr(fig1, "chain", lambda _config: Day())
    return chart()


def test_shares_of_light_add_up_and_the_sheet_has_all_views(lamps, tmp_path, monkeypatch):
    sheets = []
    monkeypatch.setattr(fig1, "write_sheet", lambda *sheet: sheets.append(sheet))
    rows = fig1.paper_fig1(picture="a.png")
    assert [row["group"] for row in rows] == ["sky", "headlights"]
    for name in ("night_share", "day_share"):
        assert sum(row[name] for row in rows) == pytest.approx(1)
    assert rows[0]["night_share"] < 1e-3 < rows[0]["day_share"]
    assert rows[1]["brightest_cd_m2"] == pytest.approx(1e6, rel=1e-3)  # float32, few bands
    [(_, (top, below), (names, below_names))] = sheets
    assert len(top) == len(names) == 2 and below_names == ["night", "day", "objects"]
    assert {view.shape for view in (*top, *below)} == {(24, 40, 3)}
    colours = {tuple(c) for c in below[2].reshape(-1, 3)}
    assert len(colours) == 6  # five discs, and black


def test_unknown_parameters_are_named():
    with pytest.raises(ConfigError, match="did you mean 'scripts'"):
        chosen("paper_fig5", "script", {"paper": 1, "scripts": 2})
