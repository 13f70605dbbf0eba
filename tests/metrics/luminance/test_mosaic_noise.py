"""Noise of demosaiced pictures: pixels of different filters have different variances, and scores
follow from their mean.
"""

import numpy as np
import pytest
from isethdr_catalog.report import plots
from isethdr_metrics.luminance.dynamic_range import DynamicRange
from isethdr_metrics.luminance.snr_curve import SnrCurve

import isethdr_core as hdr
from isethdr_core.data.reference_picture import total_variance
from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture, truth

READ = 0.02**2  # (cd/m2)^2
STEP = 3e-3  # luminance of one electron, cd/m2
BAYER = np.array([[0.4, 1.6], [1.6, 0.4]])  # shares of the variance after a bilinear demosaic
RGBW = np.random.default_rng(3).permutation(np.linspace(0.2, 1.8, 16)).reshape(4, 4)
PHASES = [(0, 0), (0, 1), (1, 0), (1, 1)]


def picture(y, variance=0.0, valid=True):
    """Return a grey picture of the luminance y (y, x), cd/m2."""
    return make_picture(
        y[..., None] * D65_XYZ,
        np.broadcast_to(variance, y.shape)[..., None] * D65_XYZ**2,
        np.broadcast_to(valid, y.shape),
        *(centres(n, n * 3e-6) for n in y.shape[::-1]),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def shares(cell, shape, phase=(0, 0)):
    """Return the cell, repeated over the shape (y, x), from the row and column of `phase` on."""
    repeats = [-(-n // side) + 1 for n, side in zip(shape, cell.shape, strict=True)]
    return np.tile(cell, repeats)[phase[0] :, phase[1] :][: shape[0], : shape[1]]


def scores_of(seen, reference):
    return {
        s.metric: s.value
        for metric in (DynamicRange(), SnrCurve(luminances_cd_m2=(0.1, 1.0, 10.0)))
        for s in metric(seen, reference)
    }


@pytest.mark.parametrize("shape", [(100, 240), (41, 239)])
@pytest.mark.parametrize("cell", [BAYER, RGBW], ids=["bayer", "rgbw"])
@pytest.mark.parametrize("phase", PHASES)
def test_the_pattern_of_a_mosaic_does_not_matter(cell, phase, shape):
    true = np.repeat(np.geomspace(1e-3, 90.0, shape[1])[None], shape[0], axis=0)
    mean = READ + STEP * true
    reference = picture(true)
    found = scores_of(picture(true, mean * shares(cell, shape, phase)), reference)
    expected = scores_of(picture(true, mean), reference)
    assert {"snr_at_0.1", "snr_at_1", "snr_at_10", "dynamic_range_dark_noise"} <= set(found)
    for name, value in expected.items():
        # 0.1 dB, 1 %: luminance changes by 5 % from column to column, so the columns of a block do
        # not have the same weight; a median over pixels is wrong by 2 dB
        tolerance = {"rel": 0.015} if name.endswith("bottom") else {"abs": 0.15}
        assert found[name] == pytest.approx(value, **tolerance)
    for name, s in (("", 1.0), ("_snr_10db", np.sqrt(10))):
        end = (s**2 * STEP + np.sqrt(s**4 * STEP**2 + 4 * s**2 * READ)) / 2
        assert expected[f"dynamic_range{name}_bottom"] == pytest.approx(end, rel=1e-6)


def uniform(cfa, level=10.0, shape=(41, 61)):
    """Return picture and reference picture of a uniform scene, taken with a Bayer sensor."""
    scene = hdr.build(
        "scene",
        "uniform",
        luminance_cd_m2=level,
        width=shape[1],
        height=shape[0],
        horizontal_field_deg=8.0,
    )()
    mixed = hdr.build("lighting", "ideal")(scene)
    light = hdr.build("lens", "ideal")(mixed)
    sensor = hdr.build("sensor", "single", cfa=cfa, rows=shape[0], columns=shape[1])
    seen = hdr.build("isp", "merge")(sensor(light, hdr.generator(seed=1, device="A")))
    return seen, truth(mixed, seen)


def test_the_four_phases_of_a_bayer_sensor_have_one_snr():
    """The SNR is that of the mean stated variance, whatever the filter of the first pixel."""
    for cfa in ("RGGB", "GRBG", "GBRG", "BGGR"):
        seen, reference = uniform(cfa)
        of_luminance = total_variance(seen).values[..., 1]
        expected = 20 * np.log10(10 / np.sqrt(of_luminance.mean()))
        # the variances of the filters differ, so a median over pixels is wrong
        wrong = 20 * np.log10(10 / np.sqrt(np.median(of_luminance)))
        found = scores_of(seen, reference)["snr_at_10"]
        # 0.1 dB: 165 blocks, the variances of which scatter by a tenth
        assert found == pytest.approx(expected, abs=0.1)
        assert abs(wrong - expected) > 0.2


@pytest.mark.parametrize("cell", [np.ones((1, 1)), BAYER], ids=["no mosaic", "bayer"])
def test_lamps_do_not_change_the_noise_of_dark_pixels(cell):
    """Their variance, and flare around them, stay out of the medians. No score arises between the
    luminances of the dark and of the lamps.
    """
    shape = 240, 320
    rng = np.random.default_rng(4)
    true = np.repeat(np.geomspace(1e-2, 2.0, shape[1])[None], shape[0], axis=0)
    rows, columns = np.indices(shape)
    lamps = np.zeros(shape, bool)
    near = np.zeros(shape, bool)
    for y, x in rng.integers(10, [shape[0] - 10, shape[1] - 10], (25, 2)):
        distance = np.hypot(rows - y, columns - x)
        lamps |= distance < 3
        near |= distance < 8
    without = scores_of(picture(true, (READ + STEP * true) * shares(cell, shape)), picture(true))
    true[lamps] = 1e5
    noise = (READ + STEP * true + near * 1.0) * shares(cell, shape)
    seen = picture(true, noise, ~(lamps & (rng.random(shape) < 0.2)))
    found = scores_of(seen, picture(true))
    for name in without:
        if name.endswith("bottom"):
            # the share of pixels next to lamps moves the medians by a few percent
            assert found[name] == pytest.approx(without[name], rel=0.05)
    for name in ("snr_at_0.1", "snr_at_1"):
        assert found[name] == pytest.approx(without[name], abs=0.3)
    table = SnrCurve().curve(seen, picture(true))
    of_many = table["luminance_cd_m2"]
    assert not ((of_many > 2.5) & (of_many < 4e4)).any()


def test_a_bright_dot_in_every_cell_gives_a_range():
    true = np.full((60, 80), 0.1)
    true[::2, ::2] = 20.0
    dots = picture(true, READ + STEP * true).assign_attrs(cfa="RGGB")
    assert {"dynamic_range_top"} <= set(scores_of(dots, picture(true)))


@pytest.mark.parametrize(("cell", "pixels"), [("RGGB", 54), ("RRGG/RRGG/GGBB/GGBB", 96)])
def test_a_score_needs_six_independent_values(cell, pixels):
    for count, present in ((pixels, True), (pixels - 1, False)):
        true = np.full((32, 32), 1.0)
        valid = np.arange(true.size).reshape(true.shape) < count
        seen = picture(true, READ + STEP * true, valid).assign_attrs(cfa=cell)
        found = SnrCurve(luminances_cd_m2=(1.0,))(seen, picture(true))
        assert bool(found) == present


def test_uneven_cells_do_not_count_as_dark():
    """Pixels beside brighter and noisier ones in two of three cells do not count."""
    base = np.repeat(np.geomspace(1e-2, 50.0, 360)[None], 240, axis=0)
    even = scores_of(picture(base, READ + STEP * base), picture(base))
    true = base.copy()
    for first in (0, 2):
        true[::2, first::6] *= 7
    noisy = 0.01 * (true != base)
    seen = picture(true, READ + STEP * true + noisy).assign_attrs(cfa="RGGB")
    found = scores_of(seen, picture(true))
    # 10 %: the darkest fifth consists of other pixels; with uneven cells it is 22 % more
    assert found["dynamic_range_bottom"] == pytest.approx(even["dynamic_range_bottom"], rel=0.1)


def test_detail_of_a_few_pixels_counts_without_a_mosaic():
    """Stripes of 3 pixels, half of them dark: all dark pixels count."""
    true = np.full((120, 240), 20.0)
    dark = np.arange(240) % 6 < 3
    true[:, dark] = np.geomspace(0.01, 0.5, dark.sum())
    stripes = picture(true, READ + STEP * true).assign_attrs(cfa="W")
    found = scores_of(stripes, picture(true))
    expected = 20 * np.log10(0.1 / np.sqrt(READ + STEP * 0.1))
    # 0.1 dB: the line through two bins
    assert found["snr_at_0.1"] == pytest.approx(expected, abs=0.1)
    assert "snr_at_10" not in found and "dynamic_range_bottom" in found


def test_the_curve_of_the_report_is_that_of_the_metric():
    shape = 80, 200
    true = np.repeat(np.geomspace(1e-2, 90.0, shape[1])[None], shape[0], axis=0)
    true[30:34, 50:60] = 1e4
    seen = picture(true, (READ + STEP * true) * shares(BAYER, shape))
    table = SnrCurve().curve(seen, picture(true))
    luminance, snr = plots.snr_curve(seen, picture(true), least=1)
    np.testing.assert_allclose(luminance, table["luminance_cd_m2"], rtol=1e-12)
    np.testing.assert_allclose(snr, table["snr_db"], atol=1e-9)
