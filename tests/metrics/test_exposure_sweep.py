"""Exposure sweep: on a colour chart from 1 ms to 16 s, no comparison rewards overexposure."""

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data.saturation import with_saturation
from isethdr_core.truth import labels_on, truth

HIGHER_IS_BETTER = {
    "ssim": True,
    "ssim_pu21": True,
    "contrast_detection": True,
    "ciede2000": False,
    "log_luminance_error": False,
    "line_profile": False,
}
FEW_SATURATED = 0.05  # share of saturated pixels; one of the 24 patches covers 0.03 of the chart


@pytest.fixture(scope="module")
def sweep():
    """Return exposures in s, saturated shares, and for each metric its scores at each exposure."""
    scene = hdr.build(
        "scene", "macbeth", width=48, height=32, horizontal_field_deg=5.0, luminance_cd_m2=100.0
    )()
    mixed = hdr.build("lighting", "ideal")(scene)
    light = hdr.build("lens", "diffraction_limited")(mixed)
    isp = hdr.build("isp", "merge")
    metrics = {name: hdr.build("metric", name) for name in (*HIGHER_IS_BETTER, "pixel_shares")}
    exposures_s = 1e-3 * 4.0 ** np.arange(8)  # the last saturates all, at 16 s
    found = {name: [] for name in metrics}
    for exposure_s in exposures_s:
        sensor = hdr.build("sensor", "bayer", exposure_s=float(exposure_s))
        captures = sensor(light, hdr.generator(seed=1, device="A", scene="chart"))
        picture = with_saturation(isp(captures), captures)
        reference = truth(mixed, picture)
        labels = labels_on(scene, picture)
        for name, metric in metrics.items():
            # pairs around each of the 24 patches would take most of the time, and follow the same
            # rule as pairs of the whole frame
            regions = None if name == "contrast_detection" else labels
            scores = metric(picture, reference, regions)
            found[name].append({(s.metric, s.object): s.value for s in scores})
    saturated = np.array([shares["saturated_share", ""] for shares in found["pixel_shares"]])
    return exposures_s, saturated, found


@pytest.mark.slow
@pytest.mark.parametrize("name", HIGHER_IS_BETTER)
def test_the_best_score_is_at_an_exposure_with_few_saturated_pixels(sweep, name):
    _, saturated, found = sweep
    frame = np.array([next(iter(scores.values())) for scores in found[name]])
    assert saturated[0] == 0 and saturated[-1] == 1
    assert np.isfinite(frame).all()
    best = np.argmax(frame) if HIGHER_IS_BETTER[name] else np.argmin(frame)
    assert saturated[best] < FEW_SATURATED
    # where more than a quarter of the chart is saturated, a longer exposure never scores better
    worse = frame[saturated > 0.25] * (-1 if HIGHER_IS_BETTER[name] else 1)
    assert len(worse) > 1 and (np.diff(worse) >= 0).all()


@pytest.mark.slow
def test_no_score_of_the_sweep_is_undefined(sweep):
    exposures_s, _, found = sweep
    wrong = [
        (name, key, exposure)
        for name, per_exposure in found.items()
        for exposure, scores in zip(exposures_s, per_exposure, strict=True)
        for key, value in scores.items()
        if not np.isfinite(value)
    ]
    assert not wrong
