"""Dynamic range of scenes whose dark parts do, or do not, show the noise at its lower ends."""

import numpy as np
import pytest
from isethdr_metrics.luminance.dynamic_range import DynamicRange

from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture
from isethdr_core.uncertainty import ledger

SHAPE = (100, 200)
STEP = 3e-3  # luminance of one electron, cd/m2
ENDS = ("", "_dark_noise", "_snr_10db")


def picture(y, variance=0.0):
    """Return a grey picture of the luminance y (y, x), cd/m2, without saturated pixels."""
    xyz = y[..., None] * D65_XYZ
    return make_picture(
        xyz,
        np.broadcast_to(variance, y.shape)[..., None] * D65_XYZ**2,
        np.ones(y.shape, bool),
        *(centres(n, n * 3e-6) for n in y.shape[::-1]),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def measured(true, read_e, spread=0.0):
    """Return the scores {name: Score} of a camera, and the reasons {what: why} of its ledger.

    Parameters
    ----------
    true : (y, x) luminance, cd/m2.
    read_e : read noise, electrons.
    spread : relative standard deviation of the stated variance of each pixel.
    """
    variance = (read_e * STEP) ** 2 + STEP * true
    rng = np.random.default_rng(0)
    variance = variance * np.exp(spread * rng.standard_normal(true.shape))
    with ledger.stage(ledger.Ledger(), "dynamic_range") as row:
        scores = DynamicRange()(picture(true, variance), picture(true))
    return {s.metric: s for s in scores}, {note.what: note.why for note in row.left_out}


def ramp(darkest, brightest=90.0):
    """Return luminances from the darkest to the brightest column, in equal ratios, cd/m2."""
    return np.repeat(np.geomspace(darkest, brightest, SHAPE[1])[None], SHAPE[0], axis=0)


def ends_of(read_e):
    """Return each lower end in closed form, cd/m2."""
    a = (read_e * STEP) ** 2
    return {
        "": (STEP + np.sqrt(STEP**2 + 4 * a)) / 2,
        "_dark_noise": np.sqrt(a),
        "_snr_10db": (10 * STEP + np.sqrt(100 * STEP**2 + 40 * a)) / 2,
    }


@pytest.mark.parametrize("read_e", [0.8, 9.0])
def test_a_scene_without_dark_parts_has_no_lower_end(read_e):
    """A colour chart of 3 to 90 cd/m2 does not show noise that equals 0.01 to 0.1 cd/m2."""
    found, why = measured(ramp(3.0), read_e, spread=0.05)
    assert list(found) == ["dynamic_range_top"]
    for end in ENDS:
        assert "the scene needs darker pixels" in why[f"dynamic_range{end}"]


@pytest.mark.parametrize("read_e", [0.8, 9.0])
@pytest.mark.parametrize("darkest", [1e-5, 1e-3])
def test_a_dark_scene_keeps_every_end(read_e, darkest):
    found, why = measured(ramp(darkest), read_e, spread=0.05)
    assert not why
    for name, end in ends_of(read_e).items():
        # 3 %: medians of hundreds of variances, which are uncertain by 5 %
        assert found[f"dynamic_range{name}_bottom"].value == pytest.approx(end, rel=0.03)
        assert found[f"dynamic_range{name}"].value == pytest.approx(
            20 * np.log10(90 / end), abs=0.3
        )


@pytest.mark.parametrize("name", ENDS)
def test_an_end_may_lie_up_to_three_times_below_the_darkest_pixels(name):
    end = ends_of(9.0)[name]
    # the darkest group of blocks may have 1.22 times the luminance of the darkest column
    for ratio, given in ((2.3, True), (3.5, False)):
        found, why = measured(ramp(ratio * end), 9.0)
        assert (f"dynamic_range{name}" in found) == given
        assert (f"dynamic_range{name}" in why) != given


@pytest.mark.parametrize("spread", [0.0, 0.05])
def test_a_camera_with_photon_noise_alone_has_no_noise_without_light(spread):
    """The lower end at SNR = 1 is then the luminance of one electron. An uncertain variance does
    not turn into read noise.
    """
    found, why = measured(ramp(STEP / 10), 0.0, spread)
    for name, electrons in (("", 1), ("_snr_10db", 10)):
        assert found[f"dynamic_range{name}_bottom"].value == pytest.approx(
            electrons * STEP, rel=0.03
        )
    assert "dynamic_range_dark_noise" not in found
    assert list(why) == ["dynamic_range_dark_noise"]
    assert "unless the camera has no such noise" in why["dynamic_range_dark_noise"]


@pytest.mark.parametrize("level_cd_m2", [0.3, 60.0])
def test_a_uniform_scene_far_above_its_noise_has_no_lower_end(level_cd_m2):
    """Its noise is one number, which does not tell read noise from shot noise."""
    found, why = measured(np.full(SHAPE, level_cd_m2), 9.0, spread=0.05)
    assert list(found) == ["dynamic_range_top"]
    assert {f"dynamic_range{end}" for end in ENDS} < set(why)


def test_a_picture_without_noise_has_no_noise_in_the_dark():
    y = ramp(1e-3)
    with ledger.stage(ledger.Ledger(), "dynamic_range") as row:
        scores = DynamicRange()(picture(y), picture(y))
    assert [s.metric for s in scores] == ["dynamic_range_top"]
    assert [note.why for note in row.left_out] == 3 * ["no noise in the dark"]


def test_the_upper_end_has_the_interval_of_the_brightest_pixel():
    found, _ = measured(ramp(1e-3), 9.0)
    top = found["dynamic_range_top"]
    half = 1.96 * np.sqrt((9 * STEP) ** 2 + STEP * 90)
    assert top.value - top.low == pytest.approx(half, rel=1e-4)
    assert np.isnan(top.high)  # no pixel is saturated, so this is a lower bound
