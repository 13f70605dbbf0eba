"""Metrics that share intermediate results of one reference picture return the same scores as
separate calls.
"""

import numpy as np
import pytest
import xarray as xr
from isethdr_metrics import regions
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_metrics.detection.object_contrast import ObjectContrast
from isethdr_metrics.luminance.dynamic_range import DynamicRange
from isethdr_metrics.luminance.log_luminance_error import LogLuminanceError
from isethdr_metrics.luminance.snr_curve import SnrCurve
from isethdr_metrics.pixel_shares import PixelShares
from isethdr_metrics.similarity.ciede2000 import Ciede2000
from isethdr_metrics.similarity.ssim import Ssim

from isethdr_core.data.derived_once import intervals_wanted, once, shared, values_only
from isethdr_core.data.reference_picture import make_picture, with_undenoised

METRICS = [
    ContrastDetection(),
    ObjectContrast(),
    DynamicRange(),
    LogLuminanceError(),
    SnrCurve(),
    PixelShares(),
    Ciede2000(),
    Ssim(),
]
SHAPE = 60, 90


def pair(seed, saturated=0.0):
    """Return a noisy picture of bars of different luminance, and its reference picture."""
    random = np.random.default_rng(seed)
    level = 10.0 ** (np.arange(SHAPE[1]) // 9 / 3)[None, :, None] * np.array([0.9, 1.0, 1.1])
    true = np.broadcast_to(level, (*SHAPE, 3)).copy()
    variance = 0.02 * true + 0.01
    axes = np.arange(SHAPE[1]) * 1e-6, np.arange(SHAPE[0]) * 1e-6

    def made(xyz, variance, valid):
        xy = {"x_m": axes[0], "y_m": axes[1]}
        return make_picture(xyz, variance, valid, **xy, focal_length_mm=4.0, pitch_um=1.0)

    valid = random.random(SHAPE) >= saturated
    noisy = true + np.sqrt(variance) * random.normal(size=true.shape)
    return made(noisy, variance, valid), made(true, np.zeros_like(true), np.ones(SHAPE, bool))


def labels():
    """Return three objects, one of which touches the border and one of which has two parts."""
    instance = np.zeros(SHAPE, np.uint32)
    instance[10:30, 20:40] = 7
    instance[50:, :12] = 2
    instance[5:9, 70:74] = instance[40:44, 60:80] = 900_000
    objects = [{"instance": 7, "name": "car"}, {"instance": 2, "name": "car"}]
    return xr.Dataset({"instance": (("y", "x"), instance)}, attrs={"objects": objects})


def rows_of(scores):
    return [(s.metric, s.unit, s.object, s.value, s.low, s.high) for s in scores]


@pytest.mark.parametrize("metric", METRICS, ids=lambda m: type(m).__name__)
def test_scores_are_the_same_alone_and_shared(metric):
    found = labels()
    truth = pair(0)[1]
    shots = [pair(seed, saturated)[0] for seed, saturated in ((1, 0.0), (2, 0.1), (1, 0.0))]
    alone = [metric(shot, truth, found) for shot in shots]
    with shared(truth, found):
        together = [metric(shot, truth, found) for shot in shots]
        with values_only():
            values = [metric(shot, truth, found) for shot in shots]
    assert alone[0]
    for one, other, bare in zip(alone, together, values, strict=True):
        np.testing.assert_equal(rows_of(one), rows_of(other))
        assert [(s.metric, s.object) for s in one] == [(s.metric, s.object) for s in bare]
        # 1e-12: the sums run in another order
        np.testing.assert_allclose(
            [s.value for s in bare], [s.value for s in one], rtol=1e-12, equal_nan=True
        )


def test_the_picture_before_denoising_is_derived_once_and_scores_stay():
    found = labels()
    plain, truth = pair(1)
    picture = with_undenoised(pair(2)[0], plain)
    metrics = [ContrastDetection(), ObjectContrast(), DynamicRange(), SnrCurve()]
    alone = [rows_of(metric(picture, truth, found)) for metric in metrics]
    with shared(picture, truth, found):
        assert regions.undenoised(picture) is regions.undenoised(picture)
        shown = regions.undenoised(picture)
        # a result that is kept is a source of further results
        assert regions.luminance_variance(shown) is regions.luminance_variance(shown)
        together = [rows_of(metric(picture, truth, found)) for metric in metrics]
    np.testing.assert_equal(together, alone)
    assert regions.undenoised(picture) is not regions.undenoised(picture)


def test_medians_of_further_realisations_are_those_of_pictures_alone():
    """The change of a median is computed from estimates, which are exact for this normal noise.
    1e-4: probabilities of neighbouring pairs around the median differ by as much.
    """
    found = labels()
    first, truth = pair(0)
    more = [pair(seed)[0] for seed in (1, 2, 3)]
    metric = ContrastDetection(interval_percent=5.0)
    alone = np.array([[s.value for s in metric(shot, truth, found)] for shot in more])
    with shared(truth, found, first), values_only():
        scores = [metric.further(shot, first, truth, found) for shot in more]
    assert [s.object for s in scores[0]] == [s.object for s in metric(first, truth, found)]
    further = np.array([[s.value for s in of_one] for of_one in scores])
    np.testing.assert_allclose(further, alone, atol=1e-4)
    assert alone.std(axis=0).max() > 1e-3  # above the tolerance, so realisations differ
    np.testing.assert_array_equal(
        [s.value for s in metric.further(more[0], first, truth, found)], further[0]
    )


@pytest.mark.parametrize("metric", [Ciede2000(20.0), Ssim(20.0), LogLuminanceError()])
def test_scores_of_parts_average_to_that_of_the_frame(metric):
    """Scores of parts, weighted by their numbers of pixels, average to the score of the frame. For
    the log luminance error, their squares do.
    """
    shot, truth = pair(1)
    part = np.where(np.arange(SHAPE[1]) < 45, 0, 1) * np.ones((SHAPE[0], 1), int)
    part[:20] = 2
    scores = metric.of_parts(shot, truth, part)
    power = 2 if isinstance(metric, LogLuminanceError) else 1
    use = np.ones(SHAPE, bool)
    if isinstance(metric, Ciede2000):
        use = truth["xyz"].values[..., 1] <= 20.0
    weights = np.bincount(part.ravel(), use.ravel())
    values = np.array([score.value for (score,) in scores])
    frame = metric(shot, truth)[0].value
    mean = np.average(values[weights > 0] ** power, weights=weights[weights > 0]) ** (1 / power)
    # 1e-5: the sums run in another order, in float32 for ssim
    assert mean == pytest.approx(frame, rel=1e-5)
    assert len(scores) == 3 and {s.metric for (s,) in scores} == {metric(shot, truth)[0].metric}


def test_contrast_detection_of_one_part_is_that_of_the_frame():
    shot, truth = pair(1)
    metric = ContrastDetection(interval_percent=5.0)
    ((score,),) = metric.of_parts(shot, truth, np.zeros(SHAPE, int))
    assert score.value == pytest.approx(metric(shot, truth)[0].value, abs=3e-7)
    halves = np.broadcast_to(np.arange(SHAPE[1]) // 45, SHAPE)
    (left,), (right,) = metric.of_parts(shot, truth, halves)
    # bars to the right are brighter, with less noise relative to their contrast
    assert left.value < score.value < right.value


def test_another_truth_within_the_block_has_scores_of_its_own():
    """A changed scene has its own reference picture, and the labels of the first scene."""
    found = labels()
    metric = LogLuminanceError()
    shot, truth = pair(1)
    brighter = truth.assign(xyz=truth["xyz"].copy(data=2 * truth["xyz"].values))
    alone = rows_of(metric(shot, brighter, found))
    with shared(truth, found):
        assert rows_of(metric(shot, truth, found)) != alone
        np.testing.assert_equal(rows_of(metric(shot, brighter, found)), alone)


def test_what_is_derived_ends_with_the_block():
    calls = []

    def compute():
        calls.append(1)
        return len(calls)

    source = object()
    other = object()
    assert [once("a", (source,), compute) for _ in range(2)] == [1, 2]
    with shared(source):
        assert [once("a", (source,), compute) for _ in range(2)] == [3, 3]
        assert once("b", (source, None), compute) == 4
        assert [once("a", (other,), compute) for _ in range(2)] == [5, 6]
    assert once("a", (source,), compute) == 7
    assert intervals_wanted()
    with values_only():
        assert not intervals_wanted()


def test_regions_are_the_frame_and_every_object():
    found = regions.regions_of(SHAPE, labels())
    instance = labels()["instance"].values
    assert [r.name for r in found] == ["", "car", "car 7", "900000"]
    for region, number in zip(found[1:], (2, 7, 900_000), strict=True):
        whole = np.zeros(SHAPE, bool)
        whole[region.window] = region.mask
        np.testing.assert_array_equal(whole, instance == number)
        np.testing.assert_array_equal(region.of(instance), instance[instance == number])
