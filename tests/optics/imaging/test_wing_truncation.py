"""Truncated PSF wings: their effect on the sensor stays below the bound, and a single lamp restores
them.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens
from isethdr_optics.imaging import wing_truncation
from isethdr_optics.imaging.sensor_plane import sensor_plane, without_geometry
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest
from scipy.special import jv

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty import ledger

BANDS = np.arange(440.0, 681.0, 20.0)
SHAPE = (30, 66)
FIELD = 0.55
LENS = DiffractionLimitedLens(focal_length_mm=4.0)
HEXAGON = ApertureFlare(dust_per_mm2=0.0, scratches_per_mm2=0.0)
SENSOR = build("sensor", "bayer", pitch_um=3.75)
PITCH_UM = (4e3 * FIELD / SHAPE[1],) * 2


def scene(low=0.7, level=2e-3, bands=BANDS, seed=1):
    """Return mixed radiance between `low` and 1 times a level, in blocks of 6 x 6 tiles."""
    blocks = (
        np.random.default_rng(seed)
        .uniform(low, 1, (SHAPE[0] // 6, SHAPE[1] // 6))
        .repeat(6, 0)
        .repeat(6, 1)
    )
    cube = (level * blocks * (1.3 - bands / 700)[:, None, None]).astype(np.float32)
    y, x = (quantities.centres(n, FIELD * n / SHAPE[1]) for n in SHAPE)
    return quantities.plane(cube, bands, x, y, quantities.RADIANCE)


def response(fraction=0.1):
    return replace(SENSOR.narrow(Demand()).response, noise_fraction_allowed=fraction)


def needed(mixed, flares=(), allowed=0.1):
    plain = without_geometry(LENS)
    wave = mixed.wavelength.values
    return wing_truncation.truncated_kernels(
        lambda reach: kernels.kernels(KernelRequest(plain, flares, wave, PITCH_UM, reach)),
        plain,
        flares,
        wing_truncation.FieldOnSensor(mixed, sensor_plane(LENS, mixed), PITCH_UM),
        response(allowed),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flares", "bands"),
    [pytest.param((), BANDS, marks=pytest.mark.slow), ((HEXAGON,), BANDS[::12])],
)
def test_forced_in_it_changes_nothing_beyond_the_bound(flares, bands):
    """Compare light of truncated kernels with light of whole kernels.

    13 bands are imaged as photocurrent, 2 bands as irradiance.
    """
    mixed = scene(bands=bands)
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        short = LENS.photocurrent(mixed, flares, response())
    assert short.attrs["units"] == (
        quantities.PHOTOCURRENT if len(bands) == 13 else quantities.IRRADIANCE
    )
    [left] = [
        o
        for o in book[0].left_out
        if o.why == "no tile is bright enough for the sensor to see a difference"
    ]
    assert left.unit == wing_truncation.UNIT and 0 < left.bound <= wing_truncation.SHARE * 0.1
    few, every = (SENSOR.expected(light).values for light in (short, LENS(mixed, flares)))
    share = np.abs(few - every) / np.sqrt(every + max(response().read_noise_e, 1.0) ** 2)
    rest = sum(e.value for e in book[0].errors if "functionals" in e.label)
    assert share.max() <= left.bound + rest + 1e-4
    assert share.max() > 0.3 * left.bound, "uniform light comes near to the bound in the corners"


def test_the_whole_promise_to_the_sensor_is_kept():
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        LENS.photocurrent(scene(), (), response())
    assert sum(e.value for e in book[0].errors if e.unit == wing_truncation.UNIT) <= 0.1


@pytest.mark.parametrize("add", [1e6, 30.0])
def test_one_lamp_brings_the_tail_back_and_nothing_is_made_to_find_out(add, monkeypatch):
    mixed = scene()
    assert needed(mixed) is not None
    monkeypatch.setattr(
        wing_truncation.kernels, "kernels", lambda *how: pytest.fail("kernels were made")
    )
    mixed.values[:, 20, 30] *= add
    assert needed(mixed) is None


def test_dark_tiles_beside_bright_ones_bring_the_tail_back():
    mixed = scene()
    mixed.values[:, :18] *= 1e-3
    assert needed(mixed) is None


@pytest.mark.slow
def test_the_bound_holds_for_the_worst_light_there_is():
    """Compare the light that replaces the wings with the extremes of what may fall on a tile.

    These are all of the light of the wings, for a dark tile in a bright field, and none of it, for
    a tile in a dark field.
    """
    made = needed(scene())
    whole = kernels.kernels(
        KernelRequest(without_geometry(LENS), (), BANDS, PITCH_UM, tuple(n - 1 for n in SHAPE))
    )
    for band, added in zip(range(len(BANDS)), made.added, strict=True):
        near = np.zeros_like(whole.bands[band])
        far = np.array(whole.bands[band], float)
        cut = tuple(
            slice((n - k) // 2, (n + k) // 2) for n, k in zip(far.shape, made.bands[band].shape)
        )
        near[cut] = made.bands[band]
        # within its reach, the truncated kernel equals the whole one
        np.testing.assert_allclose(near[cut], far[cut], atol=2e-4 * far.max())
        most = float(scene().values[band].max())
        assert (
            (far - near).sum()
            <= 2 * added / most
            <= 2.2 * (far - near).sum() + whole.outside[band] * 1.1
        )


def test_what_lies_beyond_a_kernel_is_known_in_closed_form():
    """Compare the light beyond a kernel with the closed form of a round stop.

    A share J0^2 + J1^2 of the light lies beyond a radius. The share beyond a square is the mean
    over the directions to its border.
    """
    wave = np.array([500.0, 600.0])
    reach = (15, 15)
    made = kernels.kernels(KernelRequest(without_geometry(LENS), (), wave, PITCH_UM, reach))
    angle = np.linspace(-np.pi / 4, np.pi / 4, 4001)
    for outside, nm in zip(made.outside, wave, strict=True):
        # source and receiver are whole tiles, so the border of the kernel is blurred: it lies
        # between half a tile before and half a tile beyond the edge of the last tile
        beyond = [
            np.mean(jv(0, v) ** 2 + jv(1, v) ** 2)
            for border in (15.0, 16.0)
            for v in [np.pi * border * PITCH_UM[0] / np.cos(angle) / (4e-3 * nm * 1.0)]
        ]
        assert beyond[1] * 0.97 < outside < beyond[0] * 1.03
        assert wing_truncation.EDGES * 4e-3 * nm / (16 * PITCH_UM[0]) < outside, (
            "a bound from below on any stop's tail"
        )


@pytest.mark.slow
def test_a_sensor_that_allows_less_gets_more():
    mixed = scene(bands=BANDS[::12])
    reach = [needed(mixed, allowed=a).bands[0].shape[1] for a in (1.0, 0.08)]
    assert reach[0] < reach[1] < SHAPE[1]
    assert needed(mixed, allowed=0.003) is None
