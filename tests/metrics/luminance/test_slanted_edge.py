"""Slanted edge: the response of the whole chain is the closed form of pixel aperture and
diffraction. Intervals, and pictures without an edge.
"""

import math

import numpy as np
import pytest
from isethdr_metrics.luminance.slanted_edge import SlantedEdgeResponse

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.truth import truth

PITCH_UM = 3.0
TILES = 6
FOCAL_MM = 4.0
ANGLE = 5.0


def chain(lens="ideal", f_number=4.0, rows=48, columns=72, margin=30):
    """Return the picture and the reference picture of a slanted edge in a narrow band around
    550 nm, through a sensor without filters.
    """
    width, height = (n * TILES + 2 * margin * TILES for n in (columns, rows))
    field = 2 * math.degrees(math.atan(width / TILES * PITCH_UM * 1e-3 / FOCAL_MM / 2))
    scene = hdr.build(
        "scene",
        "slanted_edge",
        width=width,
        height=height,
        horizontal_field_deg=field,
        first_nm=540.0,
        last_nm=560.0,
        step_nm=10.0,
        angle_deg=ANGLE,
    )()
    mixed = hdr.build("lighting", "weights", weights={"sky": 1.0})(scene)
    light = hdr.build("lens", lens, f_number=f_number, focal_length_mm=FOCAL_MM, falloff="none")(
        mixed
    )
    taken = hdr.build("sensor", "ideal", pitch_um=PITCH_UM, cfa="W", rows=rows, columns=columns)
    picture = hdr.build("isp", "linear")(taken(light, hdr.generator()))
    return picture, truth(mixed, picture)


def aperture(frequency):
    """Return the MTF of a square pixel along the normal of the edge, in closed form."""
    a = np.radians(ANGLE)
    return np.sinc(frequency * np.cos(a)) * np.sinc(frequency * np.sin(a))


def diffraction(frequency, f_number):
    """Return the MTF of a round stop at 550 nm in closed form (Goodman 2005, eq. 6-32)."""
    v = np.clip(frequency / PITCH_UM * 0.55 * f_number, 0, 1)
    return 2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v * v))


def test_ideal_lens_gives_the_pixels_aperture():
    found = SlantedEdgeResponse().curve(*chain())
    f = found["cycles_per_pixel"]
    assert abs(found["angle_deg"]) == pytest.approx(ANGLE, abs=0.01) and found["rows"] == 48
    # 4e-3: the profile is a straight line between the bins of a quarter pixel, an error of 0.0023
    # at 0.75 cycles per pixel
    np.testing.assert_allclose(found["response"][f <= 0.6], aperture(f[f <= 0.6]), atol=4e-3)


@pytest.mark.slow
def test_diffraction_times_aperture_is_the_closed_form():
    found = SlantedEdgeResponse().curve(*chain("diffraction_limited", 8.0))
    f = found["cycles_per_pixel"]
    # 0.012: the window cuts the line spread off at 32 pixels, where 1 % of it is left
    np.testing.assert_allclose(found["response"], aperture(f) * diffraction(f, 8.0), atol=0.012)
    beyond = f > 0.1
    np.testing.assert_allclose(
        found["response"][beyond], (aperture(f) * diffraction(f, 8.0))[beyond], atol=0.008
    )


def test_both_orientations_agree():
    picture, true = chain()
    turned = [p.rename(x="y", y="x").transpose("y", "x", "xyz_channel") for p in (picture, true)]
    upright, lying = (
        SlantedEdgeResponse().curve(*pair)["response"] for pair in ((picture, true), turned)
    )
    np.testing.assert_allclose(upright, lying, atol=1e-9)


@pytest.mark.slow
def test_interval_covers_the_noise_free_value_as_often_as_it_says():
    picture, true = chain(rows=96)
    clean = [s.value for s in SlantedEdgeResponse()(picture, true)]
    inside = []
    noisy = picture.copy(deep=True)
    rng = np.random.default_rng(0)
    for _ in range(60):
        # noise of 4 % of the bright side
        noisy["xyz"][:] = picture["xyz"].values + 4.0 * rng.standard_normal((96, 72, 1))
        scores = SlantedEdgeResponse()(noisy, true)
        inside.append([s.low <= value <= s.high for s, value in zip(scores[:2], clean)])
    # 60 trials give 95 % with a standard error of 3 %; noise biases MTF50, so its interval may miss
    # more often
    assert (np.mean(inside, 0) >= [0.8, 0.87]).all()
    assert scores[0].high - scores[0].low < 0.3


def test_without_an_edge_there_is_no_response():
    picture, true = chain()
    flat = true.copy(deep=True)
    flat["xyz"][:] = 1.0
    [score] = SlantedEdgeResponse()(picture, flat)
    assert score.metric == "slanted_edge_rows" and score.value == 0
    with pytest.raises(ConfigError, match="half_width is 2"):
        SlantedEdgeResponse(half_width=2)(picture, true)
