"""Ghosts below a sensor's noise are left out: their sum stays below the bound, and a lamp restores
them.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import GhostFlare, IdealLens
from isethdr_optics.flare.ghosts import sensor_limited
from isethdr_optics.imaging import wing_truncation
from isethdr_optics.imaging.field_optics import field_optics

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.plugins.registry import build

BANDS = np.array([450.0, 550.0, 650.0])
SHAPE = (12, 20)
FIELD = 0.6
LENS = IdealLens(f_number=4.0, focal_length_mm=6.0)
GHOSTS = GhostFlare()
RESPONSE = build("sensor", "bayer", pitch_um=3.75).narrow(Demand()).response


def scene(level=1e-3):
    cube = level * np.random.default_rng(1).uniform(0.5, 1, (3, *SHAPE)).astype(np.float32)
    y, x = (quantities.centres(n, FIELD * n / SHAPE[1]) for n in SHAPE)
    return quantities.plane(cube, BANDS, x, y, quantities.RADIANCE)


def seen(mixed):
    return sensor_limited.without_faint_ghosts(
        LENS, mixed, (GHOSTS,), field_optics(LENS, mixed, (GHOSTS,)), RESPONSE
    )


@pytest.mark.slow
def test_what_is_left_out_is_below_the_bound_and_the_bound_below_what_is_allowed():
    mixed = scene()
    (flare,), share, (left, error) = seen(mixed)
    assert 10 < len(flare.faint) < len(GHOSTS.pairs(LENS, BANDS, 0.35)[0])
    assert 0 < share <= sensor_limited.SHARE * RESPONSE.noise_fraction_allowed
    assert left.bound == error.value == share and f"{len(flare.faint)} of" in left.what
    assert left.unit == error.unit == wing_truncation.UNIT
    rate = wing_truncation.electrons(RESPONSE, BANDS) * RESPONSE.area_exposure_m2_s
    every, few, image = (
        np.tensordot(rate, light.values, 1)
        for light in (GHOSTS.irradiance(LENS, mixed), flare.irradiance(LENS, mixed), LENS(mixed))
    )
    change = np.abs(every - few) / np.sqrt(image + RESPONSE.read_noise_e**2)
    assert 0 < change.max() <= share and every.max() > 10 * np.abs(every - few).max()


def test_in_the_dark_no_ghost_is_traced_and_a_lamp_brings_all_back():
    mixed = scene(1e-7)
    (flare,), share, _ = seen(mixed)
    assert not flare.pairs(LENS, BANDS, 0.35)[0] and share > 0
    mixed.values[:, 5, 7] *= 1e6
    assert len(seen(mixed).flares[0].faint) < 0.1 * len(flare.faint)
    mixed.values[:, 5, 7] *= 1e12
    assert seen(mixed) == ((GHOSTS,), 0.0, ())


def test_dirt_of_another_flare_makes_no_ghost_fainter():
    mixed = scene(1e-7)  # the noise is that of reading
    clean = field_optics(LENS, mixed, (GHOSTS,))
    bounds = [
        sensor_limited.without_faint_ghosts(LENS, mixed, (GHOSTS,), optics, RESPONSE).bound
        for optics in (clean, replace(clean, gains=0.5 * clean.gains))
    ]
    assert bounds[1] == pytest.approx(bounds[0], rel=1e-3)


def test_other_flares_and_ghosts_of_others_are_left_as_they_are():
    haze = build("flare", "haze")
    assert sensor_limited.without_faint_ghosts(LENS, scene(), (haze,), None, RESPONSE) == (
        (haze,),
        0.0,
        (),
    )


@pytest.mark.parametrize(
    ("prescription", "coating"), [("double_gauss", ""), ("double_gauss_camera", "multilayer")]
)
def test_uniform_light_piles_up_no_more_than_the_factor_says(prescription, coating):
    """Check the factor `PEAK` with the pairs of surfaces that come nearest to it.

    The tiles are three times finer than those on which the factor was measured.
    """
    n = np.array([54, 96])
    y, x = (quantities.centres(k, 0.7 * k / n[1]) for k in n)
    mixed = quantities.plane(np.ones((3, *n), np.float32), BANDS, x, y, quantities.RADIANCE)
    flare = GhostFlare(prescription=prescription, coating=coating)
    traced, _ = flare.pairs(LENS, BANDS, float(np.hypot(x.max(), y.max())))
    peaks = []
    for pair in (p for p in traced if (p.front, p.back) in ((0, 4), (1, 11), (12, 13), (14, 15))):
        alone = sensor_limited.BrightGhosts(
            prescription=prescription,
            coating=coating,
            faint=tuple((p.front, p.back) for p in traced if p is not pair),
        )
        peaks.append(
            alone.irradiance(LENS, mixed).values.max()
            / LENS.throughput_sr()
            / (pair.share / pair.magnification**2)
        )
    assert 2 < max(peaks) < sensor_limited.PEAK


def test_what_is_left_for_the_rest_of_the_way_is_less():
    plan = LENS.plan((GHOSTS,), scene(), RESPONSE)
    share = seen(scene())[1]
    assert plan.flares[0].faint and plan.response.noise_fraction_allowed == pytest.approx(
        replace(RESPONSE).noise_fraction_allowed - share
    )
