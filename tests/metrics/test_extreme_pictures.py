"""Every metric on extreme pictures: black, saturated without valid pixels, without noise, without a
known variance.
"""

import numpy as np
import pytest
import xarray as xr
from isethdr_metrics import isethdr_components
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_metrics.luminance.dynamic_range import DynamicRange

from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture
from isethdr_core.uncertainty import ledger

ALL = {c.name: c.cls for c in isethdr_components()}
SHAPE = (48, 60)


def picture(y, variance=0.0, valid=True, **attrs):
    xyz = np.asarray(y, float)[..., None] * D65_XYZ
    ny, nx = np.shape(y)
    variances = np.broadcast_to(variance, (ny, nx))[..., None] * D65_XYZ**2
    grid = centres(nx, nx * 3e-6), centres(ny, ny * 3e-6)
    return make_picture(
        xyz,
        variances,
        np.broadcast_to(valid, (ny, nx)),
        *grid,
        focal_length_mm=4.0,
        pitch_um=3.0,
        **attrs,
    )


def scene():
    """Return the luminance of a road with a person on it, and the labels."""
    y = np.repeat(np.geomspace(0.5, 8, SHAPE[1])[None], SHAPE[0], axis=0)
    instance = np.zeros(SHAPE, np.uint32)
    instance[12:36, 20:32] = 1
    y[instance > 0] *= 3
    return y, xr.Dataset(
        {"instance": (("y", "x"), instance)}, attrs={"objects": [{"instance": 1, "name": "person"}]}
    )


def scores_of(name, shot, true, labels):
    """Return the scores of one metric by (metric, object), and its row of the ledger."""
    with ledger.stage(ledger.Ledger(), name) as row:
        found = ALL[name]()(shot, true, labels)
    return {(s.metric, s.object): s.value for s in found}, row


def extremes():
    y, _ = scene()
    noise = 0.05 * np.random.default_rng(0).standard_normal(SHAPE)
    return {
        "black without noise": picture(np.zeros(SHAPE)),
        "black with noise": picture(noise, 0.05**2),
        "saturated": picture(np.full(SHAPE, 5.0), 0.01, valid=False),
        "without noise": picture(y),
        "unknown variance": picture(y, np.nan, variance_known=False),
    }


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("case", extremes())
def test_a_score_is_finite_or_left_out_with_a_reason(name, case):
    y, labels = scene()
    found, row = scores_of(name, extremes()[case], picture(y), labels)
    wrong = {key: value for key, value in found.items() if not np.isfinite(value)}
    assert not wrong
    assert found or row.left_out


@pytest.mark.parametrize("case", ["black without noise", "saturated"])
def test_what_the_picture_does_not_show_is_not_detected(case):
    y, labels = scene()
    found, _ = scores_of("contrast_detection", extremes()[case], picture(y), labels)
    assert found == {("contrast_detection", ""): 0.0, ("contrast_detection", "person"): 0.0}


def test_noise_alone_is_detected_as_rarely_as_counting_says():
    """For two normal pixels of mean 0 and equal variance, the probability is the angle of the wedge
    over a full turn.
    """
    y, labels = scene()
    found, _ = scores_of("contrast_detection", extremes()["black with noise"], picture(y), labels)
    contrast = 0.5  # about that of person and road; the angle is largest near it
    low, high = (np.arctan((1 + c) / (1 - c)) for c in (0.5 * contrast, 1.5 * contrast))
    assert 0 < found["contrast_detection", "person"] < 1.3 * (high - low) / (2 * np.pi) < 0.1


def test_a_scene_without_contrast_has_no_detection_score():
    flat = np.ones(SHAPE)
    found, row = scores_of("contrast_detection", picture(flat, 0.01), picture(flat), None)
    assert found == {} and "lowest contrast" in row.left_out[0].why


def test_no_signal_has_no_dynamic_range():
    """Noise alone reaches 12 to 15 dB above its standard deviation, which is no dynamic range."""
    y, labels = scene()
    for case in ("black without noise", "black with noise", "saturated"):
        found, row = scores_of("dynamic_range", extremes()[case], picture(y), labels)
        assert found == {}, case
        assert "no pixel" in row.left_out[0].why


def test_a_lamp_in_the_dark_keeps_its_dynamic_range():
    y = 0.05 * np.random.default_rng(0).standard_normal(SHAPE)
    true = np.zeros(SHAPE)
    y[20, 20] = true[20, 20] = 50.0
    [whole] = [
        s for s in DynamicRange()(picture(y, 0.05**2), picture(true)) if s.metric == "dynamic_range"
    ]
    # 0.1 dB: the noise of the lamp's pixel is 0.009 dB
    assert whole.value == pytest.approx(20 * np.log10(50 / 0.05), abs=0.1)


@pytest.mark.parametrize("name", ["contrast_detection", "dynamic_range", "snr_curve"])
def test_without_a_known_variance_these_are_left_out_with_the_reason(name):
    y, labels = scene()
    found, row = scores_of(name, extremes()["unknown variance"], picture(y), labels)
    assert (
        found == {}
        and row.left_out[0].why == "the image processing is nonlinear and states no variance"
    )


@pytest.mark.parametrize("name", ["ssim", "ssim_pu21"])
def test_a_picture_smaller_than_the_window_has_no_similarity(name):
    for shape, given in (((10, 60), False), ((60, 10), False), ((1, 1), False), ((11, 11), True)):
        y = np.full(shape, 2.0)
        found, row = scores_of(name, picture(y, 0.01), picture(y), None)
        assert bool(found) == given, shape
        assert any("smaller than the window" in note.why for note in row.left_out) != given


def test_an_object_that_fills_the_frame_has_nothing_beside_it():
    y, _ = scene()
    labels = xr.Dataset(
        {"instance": (("y", "x"), np.ones(SHAPE, np.uint32))},
        attrs={"objects": [{"instance": 1, "name": "wall"}]},
    )
    found = ContrastDetection()(picture(y, 1e-6), picture(y), labels)
    assert [s.object for s in found] == [""]
