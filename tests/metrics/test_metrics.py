"""Metrics: perfect pictures, known offsets in closed form, shot noise, objects, intervals and bad
input.
"""

import numpy as np
import pytest
import xarray as xr
from isethdr_metrics import isethdr_components
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_metrics.detection.object_contrast import ObjectContrast, Sample, detectability
from isethdr_metrics.luminance.dynamic_range import DynamicRange
from isethdr_metrics.luminance.line_profile import LineProfile
from isethdr_metrics.luminance.log_luminance_error import LogLuminanceError
from isethdr_metrics.luminance.mean_luminance import MeanLuminance
from isethdr_metrics.luminance.normalized_flare import NormalizedFlare
from isethdr_metrics.luminance.slanted_edge import SlantedEdgeResponse
from isethdr_metrics.luminance.snr_curve import SnrCurve
from isethdr_metrics.pixel_shares import PixelShares
from isethdr_metrics.similarity.ciede2000 import Cie76, Cie94, Ciede2000
from isethdr_metrics.similarity.ssim import Ssim

from isethdr_core.data.saturation import with_saturation
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture
from isethdr_core.uncertainty import ledger

ALL = [c.cls for c in isethdr_components()]
NY = 48
NX = 60


def picture(y, variance=0.0, valid=True):
    """Return a grey (D65) picture of luminance y (y, x)."""
    y = np.asarray(y, float)
    xyz = y[..., None] * D65_XYZ
    ny, nx = y.shape
    return make_picture(
        xyz,
        np.broadcast_to(variance, y.shape)[..., None] * D65_XYZ**2,
        np.broadcast_to(valid, y.shape),
        centres(nx, nx * 3e-6),
        centres(ny, ny * 3e-6),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def labels(instance, names=("road", "person", "cyclist")):
    objects = [{"instance": k + 1, "name": n, "category": n} for k, n in enumerate(names)]
    return xr.Dataset(
        {"instance": (("y", "x"), instance.astype(np.uint32))}, attrs={"objects": objects}
    )


def scene():
    """Return luminance and labels of a road of 0.5 to 2 cd/m2, with a person of 2 cd/m2, a cyclist
    of 0.25 cd/m2 and a lamp.
    """
    rng = np.random.default_rng(0)
    y = np.geomspace(0.5, 2, NX) * np.exp(0.05 * rng.normal(size=(NY, NX)))
    instance = np.ones((NY, NX))
    instance[10:30, 10:16] = 2
    instance[12:30, 35:45] = 3
    y[instance == 2] = 2.0
    y[instance == 3] = 0.25
    y[20, 55] = 1e5
    return y, labels(instance)


def by_name(scores):
    return {(s.metric, s.object): s for s in scores}


@pytest.mark.parametrize(
    "metric", [Ciede2000(), Cie94(), Cie76(), Ssim(), LogLuminanceError(), LineProfile()]
)
def test_identical_pictures_are_perfect(metric):
    y, table = scene()
    for s in metric(picture(y), picture(y), table):
        if not s.metric.endswith("white"):
            assert s.value == pytest.approx(1.0 if s.metric == "ssim" else 0.0, abs=1e-12)


def test_log_error_of_a_constant_factor_is_its_logarithm():
    y, table = scene()
    found = by_name(LogLuminanceError()(picture(2 * y), picture(y), table))
    assert {o for _, o in found} == {"", "road", "person", "cyclist"}
    for s in found.values():
        assert s.value == pytest.approx(np.log10(2), rel=1e-12)
    whole = found["log_luminance_error", ""]
    # all blocks have the same error
    assert whole.low == pytest.approx(whole.value) and whole.high == pytest.approx(whole.value)
    # negative estimates count as the floor
    dark = LogLuminanceError(floor_cd_m2=0.1)(picture(-y), picture(np.full_like(y, 10.0)))
    assert dark[0].value == pytest.approx(2.0)


def test_a_saturated_pixel_counts_as_what_the_picture_shows():
    """The log error uses the luminance that the picture states. The colour difference uses the
    white that a display shows.
    """
    y = np.full((NY, NX), 10.0)
    valid = np.ones_like(y, bool)
    valid[:, : NX // 4] = False
    clipped = picture(np.where(valid, y, 2.0), valid=valid)
    assert LogLuminanceError()(clipped, picture(y))[0].value == pytest.approx(
        np.log10(5) * np.sqrt(0.25), rel=1e-12
    )
    metric = Ciede2000(white_cd_m2=40.0)
    to_white = metric(picture(np.full_like(y, 40.0)), picture(y))[0].value
    assert metric(clipped, picture(y))[0].value == pytest.approx(0.25 * to_white, rel=1e-9)
    missing = clipped.copy(deep=True)
    # an isp may return NaN there, which counts as the floor
    missing["xyz"][:, : NX // 4] = np.nan
    assert LogLuminanceError()(missing, picture(y))[0].value == pytest.approx(
        4 * np.sqrt(0.25), rel=1e-12
    )


def test_a_saturated_pixel_is_similar_only_where_the_truth_is_shown_as_white_too():
    y = np.full((NY, NX), 10.0)
    y[:, NX // 2 :] = 40.0
    valid = np.ones_like(y, bool)
    valid[: NY // 2] = False
    found = Ssim(white_cd_m2=40.0)(picture(y, valid=valid), picture(y))[0].value
    dark_and_saturated = np.mean(~valid & (y < 40))
    # 0.05: windows across the borders of the four areas
    assert 1 - dark_and_saturated - 0.05 < found <= 1 - dark_and_saturated
    everywhere = Ssim(white_cd_m2=40.0)(picture(y, valid=False), picture(y))[0].value
    assert everywhere < 0.5


def test_shares_of_valid_and_saturated_pixels_are_counted_per_region():
    y, table = scene()
    valid = np.ones_like(y, bool)
    valid[:15] = False
    shot = picture(y, valid=valid)
    person = by_name(PixelShares()(shot, picture(y), table))
    assert person["valid_share", ""].value == pytest.approx(33 / 48) and person[
        "saturated_share", ""
    ].value == pytest.approx(15 / 48)
    assert person["valid_share", "person"].value == 0.75 == person["valid_share", "person"].low
    # of the upper rows, which are not valid, only five are saturated in both captures; the others
    # count as not valid, not as saturated
    captures = xr.Dataset(
        {
            "saturated": (
                ("capture", "y", "x"),
                np.stack([~valid, np.arange(NY)[:, None] < np.full(NX, 5)]),
            )
        }
    )
    marked = by_name(PixelShares()(with_saturation(shot, captures), picture(y), table))
    assert marked["saturated_share", ""].value == pytest.approx(5 / 48) and marked[
        "valid_share", ""
    ].value == pytest.approx(33 / 48)
    # captures on another grid tell nothing about saturation
    assert "saturated" not in with_saturation(shot, captures.isel(x=slice(10)))


def test_colour_difference_of_a_grey_step_is_the_closed_form():
    """Greys differ in L* only, so dE00 = dL / S_L with S_L of the mean lightness (Sharma 2005,
    equation 15).
    """
    l1 = 50.0
    l2 = 52.0
    y1, y2 = (100 * ((v + 16) / 116) ** 3 for v in (l1, l2))
    s_l = 1 + 0.015 * (51 - 50) ** 2 / np.sqrt(20 + (51 - 50) ** 2)
    scores = Ciede2000(white_cd_m2=100.0)(
        picture(np.full((NY, NX), y2)), picture(np.full((NY, NX), y1))
    )
    assert scores[0].value == pytest.approx(2 / s_l, rel=1e-9)
    assert by_name(scores)["ciede2000_white", ""].value == 100.0
    # for greys, CIE 94 and CIE 76 are the difference in lightness
    for elder in (
        Cie94(white_cd_m2=100.0),
        Cie76(white_cd_m2=100.0),
    ):
        assert elder(picture(np.full((NY, NX), y2)), picture(np.full((NY, NX), y1)))[
            0
        ].value == pytest.approx(2.0, rel=1e-9)


def test_lamps_neither_set_the_white_nor_count_as_colour():
    y, _ = scene()
    book = ledger.Ledger()
    with ledger.stage(book, "metric") as row:
        lit = by_name(Ciede2000()(picture(y), picture(y)))["ciede2000_white", ""].value
    brighter = np.where(y > 1e4, 1e9, y)
    assert (
        by_name(Ciede2000()(picture(brighter), picture(brighter)))["ciede2000_white", ""].value
        == lit
        < 3
    )
    assert row.left_out[0].bound < 0.05


def test_a_white_patch_counts_whatever_its_last_digits_are():
    """The white patch of a chart is the white itself. Rounding must not decide what counts."""
    y = np.full((NY, NX), 10.0)
    y[:, NX // 2 :] = 90.0
    rounding = 1e-7 * np.random.default_rng(2).uniform(-1, 1, y.shape)
    exact, rounded = (
        Ciede2000()(picture(0.8 * y), picture(true))[0].value for true in (y, y * (1 + rounding))
    )
    # without a margin, a hundredth of the frame would be above the white
    assert rounded == pytest.approx(exact, rel=1e-5)


def test_ssim_falls_with_noise_and_uses_one_white():
    y, _ = scene()
    rng = np.random.default_rng(1)
    values = [
        Ssim()(picture(y * np.exp(sd * rng.normal(size=y.shape))), picture(y))[0].value
        for sd in (0.01, 0.1, 0.5)
    ]
    assert 1 > values[0] > values[1] > values[2] > -1
    # a picture at half the level differs, because the white comes from the reference picture, never
    # from the picture itself
    assert Ssim()(picture(y / 2), picture(y))[0].value < 0.995


def test_snr_of_pure_shot_noise_is_the_root_of_the_count():
    """With c electrons per cd/m2, variance = Y / c and SNR = sqrt(c Y): 10 dB per decade."""
    c = 40.0
    truth = np.repeat(np.geomspace(0.1, 1e4, 251)[:250, None], 400, axis=1)
    rng = np.random.default_rng(2)
    y = rng.poisson(c * truth) / c
    metric = SnrCurve(luminances_cd_m2=(1.0, 10.0, 1000.0, 1e7))
    table = metric.curve(picture(y, truth / c), picture(truth))
    expected = 10 * np.log10(c * table["luminance_cd_m2"])
    np.testing.assert_allclose(table["snr_db"], expected, atol=1e-9)
    # 0.45 dB: 4 standard errors, because there are 30 bins; about 3300 pixels per bin give a
    # standard deviation to 1.2 %, which is 0.1 dB
    np.testing.assert_allclose(table["snr_measured_db"], expected, atol=0.45)
    scores = by_name(metric(picture(y, truth / c), picture(truth)))
    # the scene has no pixel of 1e7 cd/m2
    assert set(scores) == {
        ("snr_at_1", ""),
        ("snr_at_10", ""),
        ("snr_at_1000", ""),
    }
    for level in (1, 10, 1000):
        assert scores[f"snr_at_{level}", ""].value == pytest.approx(
            10 * np.log10(c * level), abs=1e-9
        )
    assert table["pixels"].sum() == truth.size
    # read noise alone: 20 dB per decade, not 10
    flat = by_name(metric(picture(truth, 0.25), picture(truth)))
    for level in (1, 10, 1000):
        assert flat[f"snr_at_{level}", ""].value == pytest.approx(
            20 * np.log10(level / 0.5), abs=1e-9
        )
    with pytest.raises(ConfigError, match="bins_per_decade"):
        SnrCurve(bins_per_decade=0)(picture(y), picture(truth))


def shot_noise_scene(renderer_noise: float):
    """Return (picture, truth) of mostly 4 to 9 cd/m2 with shot noise, and 20 pixels at 12 cd/m2.

    Flare gives these 20 pixels 10 times the variance. `renderer_noise` is the relative noise of
    each pixel.
    """
    electrons_per_cd_m2 = 40.0
    rng = np.random.default_rng(5)
    truth = np.repeat(np.geomspace(4.0, 9.0, NY)[:, None], NX, axis=1)
    truth[0, :20] = 12.0
    truth *= np.exp(renderer_noise * rng.normal(size=truth.shape))
    variance = truth / electrons_per_cd_m2
    variance[0, :20] *= 10.0
    return picture(truth, variance), picture(truth)


@pytest.mark.parametrize("renderer_noise", [0.0, 0.1])
def test_snr_at_a_level_does_not_rest_on_a_few_pixels(renderer_noise):
    """Twenty pixels with flare are the only ones above 10 cd/m2, until renderer noise adds others.

    In both cases the shot noise of the many pixels sets the score. With renderer noise, a fifth of
    the pixels above 10 cd/m2 have flare, so the median there moves by at most an eighth of a bin of
    1.67 dB: 0.2 dB.
    """
    seen, truth = shot_noise_scene(renderer_noise)
    found = by_name(SnrCurve(luminances_cd_m2=(10.0,))(seen, truth))
    assert found["snr_at_10", ""].value == pytest.approx(10 * np.log10(40.0 * 10.0), abs=0.2)


def test_snr_needs_six_independent_pixels_near_the_level():
    """One pixel in 16 is independent, and the ranks of six values enclose a median at 95 %."""
    metric = SnrCurve(luminances_cd_m2=(10.0,))
    y = np.full((NY, NX), 0.1)
    y[:8, :12] = 11.0  # 96 pixels
    for not_valid, given in ((0, True), (1, False)):
        valid = np.ones(y.shape, bool)
        valid[0, :not_valid] = False
        with ledger.stage(ledger.Ledger(), "metrics") as row:
            scores = metric(picture(y, y / 40.0, valid), picture(y))
        assert [score.metric for score in scores] == ["snr_at_10"] * given
        assert any("fewer than 96 valid pixels" in note.why for note in row.left_out) != given


def test_dynamic_range_of_read_and_shot_noise_is_the_closed_form():
    # variance a + b Y, with a in (cd/m2)^2 and b in cd/m2: SNR = 1 at Y = (b + sqrt(b^2 + 4 a)) / 2
    a = 4e-4
    b = 2e-3
    truth = np.repeat(np.geomspace(1e-2, 1e4, 300)[:, None], 20, axis=1)
    valid = truth < 5e3
    found = by_name(DynamicRange()(picture(truth, a + b * truth, valid), picture(truth)))
    bottom = (b + np.sqrt(b * b + 4 * a)) / 2
    top = truth[valid].max()
    assert found["dynamic_range_bottom", ""].value == pytest.approx(bottom, rel=1e-6)
    total = found["dynamic_range", ""]
    assert total.value == pytest.approx(20 * np.log10(top / bottom), abs=1e-5)
    # the line is exact, so half of the interval is 1.96 standard deviations of the brightest pixel,
    # in dB; 1e-3: rounding of the fit
    half = 1.96 * 20 / np.log(10) * np.sqrt(a + b * top) / top
    assert total.high - total.value == pytest.approx(
        half, rel=1e-3
    ) and total.value - total.low == pytest.approx(half, rel=1e-3)
    unsaturated = DynamicRange()(picture(truth, a + b * truth), picture(truth))[0]
    assert np.isnan(unsaturated.high) and unsaturated.low < unsaturated.value  # a lower bound only
    # pixels in the dark corners of a lens are not valid, and not saturated either
    dark_corner = picture(truth, a + b * truth, truth > 2e-2)
    nothing = np.zeros(truth.shape, bool)
    of_corner = DynamicRange()(dark_corner.assign(saturated=(("y", "x"), nothing)), picture(truth))
    assert np.isnan(of_corner[0].high) and np.isfinite(of_corner[0].value)
    assert DynamicRange()(picture(truth, 1.0, False), picture(truth)) == []  # no pixel is valid


def test_profile_runs_through_the_brightest_lamp():
    y, _ = scene()
    metric = LineProfile()
    line = metric.profile(picture(y * 10, 0.01), picture(y))
    assert line["row"] == 20
    np.testing.assert_allclose(line["log10_picture"] - line["log10_truth"], 1, atol=1e-12)
    assert (line["log10_low"] < line["log10_picture"]).all() and (
        line["log10_high"] > line["log10_picture"]
    ).all()
    unknown = metric.profile(picture(y, np.nan), picture(y))
    assert np.isnan([unknown["log10_low"], unknown["log10_high"]]).all()
    assert metric(picture(y * 10), picture(y))[0].value == pytest.approx(1)
    assert LineProfile(row=3).profile(picture(y), picture(y))["row"] == 3
    with pytest.raises(ConfigError, match="has row=99"):
        LineProfile(row=99)(picture(y), picture(y))


def test_a_contrast_against_no_light_is_left_out():
    instance = np.zeros((NY, NX))
    instance[10:30, 10:20] = 2
    y = np.where(instance == 2, 0.5, 0.0)
    with ledger.stage(ledger.Ledger(), "contrast") as row:
        scores = ObjectContrast()(picture(y + 0.1, 0.02), picture(y), labels(instance))
    found = by_name(scores)
    assert all(np.isfinite(score.value) for score in scores)
    assert found["object_contrast", "person"].value == pytest.approx(5)
    assert ("object_contrast_truth", "person") not in found
    [note] = row.left_out
    assert note.what == "object_contrast_truth of person" and "no light around it" in note.why


def test_contrast_is_webers_and_its_snr_follows_the_variance():
    instance = np.zeros((NY, NX))
    instance[10:30, 10:20] = 2
    y = np.where(instance == 2, 0.5, 2.0)
    veil = 2.0  # flare adds the same light everywhere and so takes contrast away
    found = by_name(ObjectContrast()(picture(y + veil, 0.02), picture(y), labels(instance)))
    assert found["object_contrast_truth", "person"].value == pytest.approx(-0.75)
    assert found["object_contrast", "person"].value == pytest.approx((2.5 - 4) / 4)
    assert found["object_contrast_snr", "person"].value == pytest.approx(1.5 / np.sqrt(0.04))
    s = found["object_contrast", "person"]
    assert s.low < s.value < s.high
    # The person has 200 pixels. Its ring is round(0.2 sqrt(200)) = 3 pixels wide, as counted in
    # steps between neighbours: 3 (20 + 10) x 2 pixels along the sides, and 3 in each corner.
    noise = 3 * np.sqrt(0.02 / 200 + 0.02 / (2 * 3 * 30 + 4 * 3))
    assert found["object_d_prime", "person"].value == pytest.approx(1.5 / noise)
    assert found["object_d_prime_clutter", "person"].value == pytest.approx(1.5 / noise)
    rows = ledger.Ledger()
    with ledger.stage(rows, "contrast"):
        assert ObjectContrast()(picture(y), picture(y), None) == []
    assert "no label 'instance'" in rows[0].left_out[0].why


def test_detectability_follows_its_closed_form():
    rng = np.random.default_rng(5)
    ground_sd = 0.3
    noise_sd = 0.2
    inside = Sample(2.0 + noise_sd * rng.normal(size=900), np.full(900, noise_sd**2))
    ground = 1.5 + ground_sd * rng.normal(size=2500)
    around = Sample(ground + noise_sd * rng.normal(size=2500), np.full(2500, noise_sd**2))
    found = detectability(inside, around)
    of_means = noise_sd * np.sqrt(1 / 900 + 1 / 2500)
    # five standard errors of the difference of the means, which is 0.5; they include the spread of
    # the ground's pixels
    error = 5 * np.hypot(of_means, ground_sd / 50) / 0.5
    assert found.by_noise == pytest.approx(0.5 / (3 * of_means), rel=error)
    # plus five standard errors of a standard deviation from 2500 pixels
    clutter = np.hypot(3 * of_means, ground_sd)
    assert found.with_clutter == pytest.approx(0.5 / clutter, rel=error + 5 / np.sqrt(2 * 2500))
    free = inside._replace(variance=np.zeros(900)), around._replace(variance=np.zeros(2500))
    assert detectability(*free).by_noise == np.inf


def test_intervals_hold_the_true_mean_as_often_as_they_say():
    rng = np.random.default_rng(3)
    sd = 1.0
    hits = 0
    n = 200
    for _ in range(n):
        y = 10 + sd * rng.normal(size=(NY, NX))
        [s] = MeanLuminance()(picture(y, sd**2), picture(y))
        hits += s.low <= 10 <= s.high
    # by design, the interval is three times too wide for pixels without demosaic: 5.9 standard
    # errors to either side
    assert hits == n
    from isethdr_metrics.regions import mean_interval

    found = [mean_interval(rng.normal(size=(NY, NX)), np.ones((NY, NX), bool)) for _ in range(n)]
    inside = np.mean([low <= 0 <= high for _, low, high in found])
    # 95 %, less 1 % because there are only 144 blocks; the standard error of 200 trials is 1.5 %
    assert 0.88 <= inside <= 0.99


def test_small_regions_have_no_resampled_interval():
    from isethdr_metrics.regions import mean_interval

    mask = np.zeros((NY, NX), bool)
    mask[3:5, 3:5] = True
    mean, low, high = mean_interval(np.ones((NY, NX)), mask)
    assert mean == 1 and np.isnan(low) and np.isnan(high)


@pytest.mark.parametrize("cls", ALL)
def test_every_metric_takes_any_picture_with_truth_and_refuses_others(cls):
    y, table = scene()
    noisy = picture(y * 1.1, 0.01 + 0.01 * y)
    scores = cls()(noisy, picture(y), table)
    assert scores and all(isinstance(s.value, float) and np.isfinite(s.value) for s in scores)
    assert len({(s.metric, s.object) for s in scores}) == len(scores)
    assert cls()(noisy, picture(y), table)[0] == scores[0]  # the same picture, the same score
    with pytest.raises(UnitError, match="shape"):
        cls()(noisy, picture(y[:-1]), table)
    with pytest.raises(UnitError, match="no variable 'variance'"):
        cls()(noisy.drop_vars("variance"), picture(y), table)
    dark = picture(np.zeros((NY, NX)), 1.0)
    # an empty scene gives numbers or NaN, no error
    assert all(not np.isinf(s.value) for s in cls()(dark, dark, table))


@pytest.mark.parametrize("cls", ALL)
def test_metrics_ask_for_the_labels_they_read_and_no_more(cls):
    narrowed = cls().narrow(Demand()) if hasattr(cls, "narrow") else Demand()
    assert narrowed.labels == (
        frozenset()
        if cls in (SnrCurve, DynamicRange, LineProfile, NormalizedFlare, SlantedEdgeResponse)
        else {"instance"}
    )


@pytest.mark.parametrize(
    "metric", [ContrastDetection(), DynamicRange(), SnrCurve(), MeanLuminance(), ObjectContrast()]
)
def test_fixed_pattern_counts_like_temporal_noise(metric):
    """Variance that is half temporal noise and half fixed pattern gives the same scores as temporal
    noise alone. There is no shot noise here.
    """
    y, table = scene()
    both = picture(y, 0.02)
    both["variance"] *= 0.5
    both["fixed_pattern_variance"] = both["variance"].copy()
    whole, parts, less = (
        by_name(metric(shot, picture(y), table))
        for shot in (picture(y, 0.02), both, picture(y, 0.01))
    )
    assert whole.keys() == parts.keys()
    for key, score in whole.items():
        if key[0] == "object_d_prime":  # temporal noise alone, half of the variance
            assert parts[key].value == pytest.approx(np.sqrt(2) * score.value, rel=1e-9)
            continue
        if key[0] == "object_d_prime_clutter":  # a fixed pattern is part of the spread
            continue
        assert (parts[key].value, parts[key].low) == pytest.approx(
            (score.value, score.low), rel=1e-9, nan_ok=True
        )
    assert any(
        (less[key].value, less[key].low) != (score.value, score.low) for key, score in whole.items()
    )


def test_two_objects_of_one_name_stay_apart():
    y, table = scene()
    table.attrs["objects"][2]["name"] = "person"
    found = by_name(MeanLuminance()(picture(y), picture(y), table))
    assert found["luminance", "person"].value == pytest.approx(2) and found[
        "luminance", "person 3"
    ].value == pytest.approx(0.25)
