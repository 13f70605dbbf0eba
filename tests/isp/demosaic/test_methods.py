"""Demosaic methods: exact constants, smaller errors than bilinear interpolation, variance, and
clear errors.
"""

import sys

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.demosaic.interpolation import interpolated
from isethdr_isp.demosaic.learned import RADIUS
from isethdr_isp.demosaic.methods import METHODS, chosen, interpolate
from isethdr_isp.readout.noise_propagation import independent
from isethdr_isp.spectra import light

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.truth import total_variance, variance_known
from isethdr_core.uncertainty import ledger

RGBW_4X4 = np.array([[3, 1, 3, 0], [1, 3, 0, 3], [3, 2, 3, 1], [2, 3, 1, 3]])
BAYER = np.array([[0, 1], [1, 2]])
SHAPE = (64, 72)


def tiled(pattern, shape=SHAPE):
    return np.tile(pattern, (shape[0] // len(pattern) + 1, shape[1] // len(pattern) + 1))[
        : shape[0], : shape[1]
    ]


def textured(channels):
    """Return planes (channel, y, x) in electrons. All channels show the same fine stripes and
    edges, as in most of a scene.
    """
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    shape = 1000 + 500 * np.sin(0.9 * x + 0.4 * y) + 600 * (x + 2 * y > 110)
    return np.array([0.6, 1.0, 0.7, 2.0])[:channels, None, None] * shape


def run(method, planes, pattern, names, noise=0.0, rng=None):
    filters = tiled(pattern)
    mosaic = np.take_along_axis(planes, filters[None], 0)[0]
    if rng is not None:
        mosaic = mosaic + noise * rng.standard_normal(mosaic.shape)
    return interpolate(
        method,
        mosaic,
        filters,
        list(names),
        np.full(mosaic.shape, noise**2),
        np.zeros(mosaic.shape, bool),
    )


def rms(seen, planes):
    return np.sqrt(np.mean((seen - planes)[:, 8:-8, 8:-8] ** 2))


def needs_package(method):
    if method in ("malvar", "menon"):
        pytest.importorskip(
            "colour_demosaicing",
            reason="colour-demosaicing is not installed: pip install 'isethdr[demosaic]'",
        )


@pytest.mark.parametrize("method", METHODS)
def test_constants_of_any_sign_come_back_exactly(method):
    needs_package(method)
    planes = np.broadcast_to(np.array([-3.0, 40.0, 7.0])[:, None, None], (3, *SHAPE))
    seen = run(method, planes, BAYER, "RGB", noise=1.0).planes
    # Menon extends the picture beyond its border in another way, so the border is left out; 1e-9:
    # rounding of sums over windows
    np.testing.assert_allclose(seen[:, 8:-8, 8:-8], planes[:, 8:-8, 8:-8], atol=1e-9)


@pytest.mark.parametrize("method", ["malvar", "menon", "guided"])
def test_published_and_guided_methods_beat_bilinear_on_bayer(method):
    needs_package(method)
    planes = textured(3)
    assert rms(run(method, planes, BAYER, "RGB", 1.0)[0], planes) < 0.9 * rms(
        run("bilinear", planes, BAYER, "RGB", 1.0)[0], planes
    )


def test_guide_of_clear_pixels_halves_the_error_of_rgbw():
    planes = textured(4)
    plain, guided = (
        rms(run(m, planes, RGBW_4X4, "RGBW", 1.0)[0], planes) for m in ("bilinear", "guided")
    )
    assert guided < 0.5 * plain


def test_without_a_denser_channel_there_is_no_guide_and_the_ledger_says_so():
    book = ledger.Ledger()
    with ledger.stage(book, "isp") as row:
        seen = run("guided", textured(4), np.array([[0, 1], [3, 2]]), "RGBW", 1.0)[0]
    np.testing.assert_array_equal(
        seen, run("bilinear", textured(4), np.array([[0, 1], [3, 2]]), "RGBW", 1.0)[0]
    )
    assert "no channel is sampled more" in row.left_out[0].why


def test_guided_keeps_own_samples_and_costs_little_in_noise():
    planes = np.full((4, *SHAPE), 10.0)
    rng = np.random.default_rng(0)
    filters = tiled(RGBW_4X4)
    mosaic = 10 + 5 * rng.standard_normal(SHAPE)
    args = mosaic, filters, list("RGBW"), np.full(SHAPE, 25.0), np.zeros(SHAPE, bool)
    plain = interpolate("bilinear", *args)[0]
    guided = interpolate("guided", *args)[0]
    np.testing.assert_allclose(np.take_along_axis(guided, filters[None], 0)[0], mosaic, rtol=1e-12)
    assert rms(guided, planes) < 1.1 * rms(plain, planes)  # the slope is shrunk by the noise


@pytest.mark.slow
def test_malvars_variance_is_that_of_the_noise():
    needs_package("malvar")
    planes = np.full((3, *SHAPE), 50.0)
    rng = np.random.default_rng(1)
    draws = np.stack([run("malvar", planes, BAYER, "RGB", 2.0, rng)[0] for _ in range(150)])[
        ..., 8:-8, 8:-8
    ]
    reported = run("malvar", planes, BAYER, "RGB", 2.0).noise_map.variance(
        np.eye(3), independent(np.full(SHAPE, 4.0))
    )
    # 150 realisations of about 300 independent pixels: one standard error is 0.7 %
    np.testing.assert_allclose(
        draws.var(0).mean((1, 2)), reported[:, 8:-8, 8:-8].mean((1, 2)), rtol=0.03
    )


@pytest.mark.parametrize("method", ["guided", "menon", "learned"])
def test_methods_that_follow_the_picture_state_no_variance_and_say_so(bench, method):
    needs_package(method)
    book = ledger.Ledger()
    with ledger.stage(book, "isp") as row:
        picture = LinearIsp(demosaic=method)(bench.make(np.full((24, 32), 50.0)))
    assert f"variance of demosaic {method}" in row.left_out[0].what
    assert not variance_known(picture) and np.isnan(total_variance(picture).values).all()
    assert variance_known(LinearIsp()(bench.make(np.full((24, 32), 50.0))))


def test_automatic_takes_learned_filters_where_they_are_trained():
    rg_wb = np.array([[0, 1], [3, 2]])
    trained = [(BAYER, "RGB"), (BAYER[::-1], "RGB"), (rg_wb, "RGBW"), (RGBW_4X4, "RGBW")]
    for cell, names in trained:
        assert chosen("automatic", tiled(cell), list(names)) == "learned"
        assert chosen("bilinear", tiled(cell), list(names)) == "bilinear"
    ryyb = np.array([[0, 1], [1, 2]]), "RYB"
    for cell, names in (ryyb, (np.zeros((1, 1), int), "C")):
        assert chosen("automatic", tiled(cell), list(names)) == "guided"
    # smaller than a filter
    assert chosen("automatic", tiled(BAYER, (6, 40)), list("RGB")) == "guided"


def test_near_samples_that_are_not_valid_learned_is_bilinear():
    """A clipped lamp therefore makes no more pixels invalid, and its value reaches no further, than
    with bilinear interpolation.
    """
    filters = tiled(BAYER)
    mosaic = np.take_along_axis(textured(3), filters[None], 0)[0]
    bad = np.zeros(SHAPE, bool)
    bad[30, 41] = True
    args = mosaic, filters, list("RGB"), np.full(SHAPE, 4.0)
    clean, _, _ = interpolate("learned", *args, np.zeros(SHAPE, bool))
    found = interpolate("learned", *args, bad)
    plain = interpolate("bilinear", *args, bad)
    np.testing.assert_array_equal(found.invalid, plain.invalid)
    near = np.zeros(SHAPE, bool)
    near[30 - RADIUS : 31 + RADIUS, 41 - RADIUS : 42 + RADIUS] = True
    np.testing.assert_array_equal(found.planes, np.where(near, plain.planes, clean))


@pytest.mark.parametrize("method", ["guided", "malvar", "learned"])
def test_a_clipped_sample_changes_no_pixel_that_is_valid(method):
    needs_package(method)
    filters = tiled(BAYER)
    mosaic = np.take_along_axis(textured(3), filters[None], 0)[0]
    bad = np.zeros(SHAPE, bool)
    bad[30, 41] = True
    first, second = (
        interpolate(
            method,
            np.where(bad, clipped, mosaic),
            filters,
            list("RGB"),
            np.full(SHAPE, 4.0),
            bad,
        )
        for clipped in (0.0, 1e5)
    )
    np.testing.assert_array_equal(first.invalid, second.invalid)
    valid = ~first.invalid
    assert valid.sum() > SHAPE[0] * SHAPE[1] - 30
    # 1e-9: rounding of sums over windows
    np.testing.assert_allclose(second.planes[:, valid], first.planes[:, valid], rtol=1e-9)


def test_malvar_keeps_colours_apart_at_the_border():
    needs_package("malvar")
    planes = np.broadcast_to(np.array([100.0, 40.0, 7.0])[:, None, None], (3, *SHAPE))
    np.testing.assert_allclose(run("malvar", planes, BAYER, "RGB").planes, planes, rtol=1e-12)
    found = run("malvar", textured(3), BAYER, "RGB")
    filters = tiled(BAYER)
    mosaic = np.take_along_axis(textured(3), filters[None], 0)[0]
    np.testing.assert_allclose(interpolated(found.noise_map, mosaic), found.planes, rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_grey_keeps_its_level_through_the_isp(bench, method):
    needs_package(method)
    grey = 100 * light("daylight", bench.WAVELENGTH)
    picture = MergeIsp(demosaic=method)(bench.make(bench.mosaic_of(grey, (24, 32)), bench.SPLIT))
    np.testing.assert_allclose(picture.xyz.values[6:-6, 6:-6, 1], 100.0, rtol=1e-6)
    assert picture.valid.values.all()


def test_errors_name_the_way_out(bench, monkeypatch):
    captures = bench.make(np.full((24, 32), 50.0))
    with pytest.raises(ConfigError, match="demosaic is 'malvr'; expected .*'malvar'"):
        LinearIsp(demosaic="malvr")(captures)
    with pytest.raises(UnitError, match="for Bayer arrays.*guided"):
        LinearIsp(demosaic="menon")(
            bench.make(np.full((24, 32), 50.0), pattern=bench.RGBW, qe=bench.QE_W)
        )
    monkeypatch.setitem(sys.modules, "colour_demosaicing", None)
    with pytest.raises(ConfigError, match=r"pip install 'isethdr\[demosaic\]'"):
        LinearIsp(demosaic="malvar")(captures)
