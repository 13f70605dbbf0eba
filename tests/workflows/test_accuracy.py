"""The study of accuracy: the front of the best settings, errors of the expected size, and stored
results.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured import accuracy
from isethdr_measured.accuracy import basis, dynamics, psf, stored
from isethdr_workflows import study_command
from isethdr_workflows.accuracy import point
from isethdr_workflows.accuracy.diagram import DPI, WIDTH_IN, draw
from isethdr_workflows.accuracy.point import Point, Work, as_rows, front, refuse_what_does_not_fit
from PIL import Image

from isethdr_core.errors import ConfigError
from isethdr_core.storage import store


@pytest.fixture(autouse=True)
def once(monkeypatch):
    """Repeat no call to measure its time, because times are not tested."""
    monkeypatch.setattr(point, "SHORT_S", 0.0)


def test_a_front_keeps_what_no_other_setting_beats():
    points = [
        Point("slow", 1e-3, 4.0),
        Point("right", 1e-6, 5.0),
        Point("worse", 1e-2, 4.5),
        Point("quick", 1.0, 1.0),
        Point("broken", np.nan, 0.5),
    ]
    assert [p.setting for p in front(points)] == ["quick", "slow", "right"]
    assert [r["front"] for r in as_rows(Work("s", "e", "r", 0.0, points))] == [
        True,
        True,
        False,
        True,
        False,
    ]


@pytest.mark.parametrize("errors", [(np.nan, np.nan), (np.inf, 0.1), (0.0, np.inf)])
def test_errors_that_are_unknown_or_infinite_can_be_drawn(tmp_path, errors):
    """All pixels of a picture may be saturated; then no setting has a known error."""
    points = [Point("a", error, 1.0) for error in errors]
    draw([Work("s", "e", "r", np.nan, points, 0.1, np.inf)], tmp_path / "d.png")
    with Image.open(tmp_path / "d.png") as picture:
        assert picture.width == round(WIDTH_IN * DPI)


def test_a_reference_error_that_numpy_computed_is_drawn(tmp_path):
    points = [Point("a", 0.1, 1.0), Point("b", 0.01, 2.0)]
    draw([Work("s", "e", "r", np.float64(0.005), points, 0.05)], tmp_path / "d.png")
    assert (tmp_path / "d.png").stat().st_size > 0


@pytest.mark.slow
def test_bits_kept_halve_the_error_each(monkeypatch):
    monkeypatch.setattr(stored, "SIZE", (64, 36))
    (work,) = stored.measured()
    for bits, each in zip(stored.BITS[:-1], work.points):
        # rounding to the nearest gives an error of at most half a step, and some value comes close
        assert 0.4 < each.error / 2.0 ** -(bits + 1) <= 1.0 + 1e-6
    assert work.points[-1].error == 0
    assert [p.mark for p in work.points].count("default") == 1


@pytest.mark.slow
def test_the_closed_form_of_a_pixel_beats_every_integrator(monkeypatch):
    monkeypatch.setattr(dynamics, "PIXELS", 500)
    (work,) = dynamics.measured()
    ours = next(p for p in work.points if p.mark == "default")
    assert ours.error < 1e-14  # a few roundings of float64; the reference has 60 digits
    # explicit integrators with up to 1024 steps fail, because the equation is stiff
    assert all(p.error > 1e-3 for p in work.points if p.mark == "peer")
    assert min(p.error for p in work.points if p.setting.startswith("implicit")) < 1e-6


def test_a_stage_without_knobs_says_so():
    with pytest.raises(ConfigError, match="no stage 'lighting'.*no diagram"):
        accuracy.accuracy(stage="lighting")


def test_a_reference_that_does_not_fit_is_refused_with_the_nearest_that_does():
    with pytest.raises(
        ConfigError,
        match=(
            r"2000 points take 4 GB, 1 GB are free; the largest that fits is 1000: type"
            r" reference=1000"
        ),
    ):
        refuse_what_does_not_fit("points", 2000, lambda n: n**2 * 1000, free_bytes=10**9)
    refuse_what_does_not_fit("points", 1000, lambda n: n**2 * 1000, free_bytes=10**9)
    with pytest.raises(ConfigError, match="none fits"):
        refuse_what_does_not_fit("points", 2, lambda n: n * 10**9, free_bytes=1)
    with pytest.raises(
        ConfigError,
        match=(
            r"points per tile of the psf reference take .* GB are free; the largest that fits"
            r" is \d+"
        ),
    ):
        accuracy.accuracy(stage="psf", reference=10**6)
    with pytest.raises(ConfigError, match="expected a whole number of points per tile"):
        accuracy.accuracy(stage="psf", reference=-1)
    with pytest.raises(ConfigError, match="type stage=psf"):
        accuracy.accuracy(stage="stored", reference=8)


def test_the_point_spread_is_airy_s(monkeypatch):
    monkeypatch.setattr(psf, "SUB_BANDS", (1, 4))
    monkeypatch.setattr(psf, "WAVES", 24)
    bands, support = psf.measured()
    one, four, chosen = bands.points
    assert (
        four.error < one.error / 3
        # sub-bands are a midpoint rule: a quarter of the step has a sixteenth of the error, until
        # other errors dominate
    )
    assert chosen.error < 1e-4 and support.reference_error < 2e-5  # share of the light, L1
    assert [p.error for p in support.points] == sorted(
        (p.error for p in support.points), reverse=True
    )
    # a support of three tiles lacks the light that diffraction spreads farther
    assert support.points[0].error > 0.01


@pytest.mark.slow
def test_functionals_are_within_the_noise_allowed(monkeypatch):
    monkeypatch.setattr(basis, "PIXELS", 20)
    monkeypatch.setattr(basis, "ALLOWED", (0.1,))
    (work,) = basis.measured()
    for each in work.points:
        assert each.error < 0.1
    assert any("functionals" in p.setting for p in work.points)  # they were tried
    # 1e-4: float32 light of 1e4 electrons has an error of 6e-8 x 1e4 / 1e2, and sums add to it
    assert next(p for p in work.points if p.mark == "peer").error < 1e-4


def test_rows_of_a_study_are_kept_and_found(tmp_path, monkeypatch):
    from isethdr_catalog.query import find

    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    rows = [
        {"stage": "a", "error": 0.5, "front": True},
        {"stage": "b", "error": 0.25, "front": False},
    ]
    path = study_command.keep("accuracy", ["stage=a"], rows)
    back = store.open_store(path, "")
    assert list(back["stage"].values) == ["a", "b"] and list(back["error"].values) == [0.5, 0.25]
    assert find(tmp_path, kind="study", name="accuracy")[0]["path"] == f"studies/{path.name}"
