"""Data with any possible mistake are refused between stages, with the mistake and a remedy in the
message.
"""

from __future__ import annotations

import numpy as np
import pytest

from isethdr_core.conformance import inputs
from isethdr_core.errors import UnitError
from isethdr_core.quantities import (
    centres,
    check_irradiance,
    check_mixed,
    check_photocurrent,
    check_scene,
    check_scene_form,
    full_field,
    photocurrent,
    scene_radiance,
    tile_pitch,
    tristimulus,
)

LIGHT = inputs.irradiance(1e-3, 6, 8, 3e-6, bands=5)
BORDERS = {
    "scene radiance": (check_scene, inputs.scene(), inputs.damaged_scenes),
    "mixed radiance": (check_mixed, inputs.mixed(), inputs.damaged_planes),
    "irradiance": (check_irradiance, LIGHT, inputs.damaged_planes),
}
CASES = [
    (border, what) for border, (_, good, damage) in BORDERS.items() for what, _ in damage(good)
]
EXPECTED = {
    "NaN light": "NaN",
    "infinite light": "infinite",
    "negative light": "negative",
    "unsorted wavelengths": "sortby",
    "wavelengths in micrometres": "expected nanometres",
    "wavelengths in metres": "expected nanometres",
    "missing wavelengths": "no coordinate 'wavelength'",
    "other dims": "expected \\(",
    "a missing dim": "expected \\(",
    "other units": "has units 'W m-2'",
    "missing units": "has units None",
    "no bands": "empty",
    "no tiles": "empty",
    "no variable radiance": "needs a variable 'radiance'",
}


@pytest.mark.parametrize("border", BORDERS)
def test_good_data_passes(border):
    check, good, _ = BORDERS[border]
    check(good)


@pytest.mark.parametrize(("border", "what"), CASES)
def test_damaged_data_is_refused(border, what):
    check, good, damage = BORDERS[border]
    with pytest.raises(UnitError, match=EXPECTED[what]) as found:
        check(dict(damage(good))[what])
    assert border in str(found.value)


@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", "f2"])
@pytest.mark.parametrize(
    ("value", "good"),
    [
        (-0.0, True),
        (6e4, True),
        (6e-8, True),
        (-6e-8, False),
        (np.inf, False),
        (-np.inf, False),
        (np.nan, False),
        (-np.nan, False),
    ],
)
def test_light_is_judged_alike_whatever_its_bits(dtype, value, good):
    mixed = inputs.mixed().astype(dtype)
    # values include signed zero, and numbers near the smallest and the largest of half precision
    mixed.values[1, 2, 3] = value
    if good:
        check_mixed(mixed)
    else:
        with pytest.raises(UnitError, match="negative light|NaN or infinite"):
            check_mixed(mixed)


@pytest.mark.parametrize("wavelength", [np.nan, np.inf, 0.0, -450.0])
def test_wavelengths_are_positive_numbers(wavelength):
    bad = inputs.mixed().assign_coords(wavelength=[wavelength, 475.0, 550.0, 625.0, 700.0])
    with pytest.raises(UnitError, match="positive number"):
        check_mixed(bad)


def test_repeated_wavelengths_are_refused():
    with pytest.raises(UnitError, match="repeated"):
        check_mixed(inputs.mixed().assign_coords(wavelength=[400.0, 475.0, 475.0, 625.0, 700.0]))


@pytest.mark.parametrize("dim", ["x", "y"])
def test_uneven_or_falling_tiles_are_refused(dim):
    good = inputs.mixed()
    moved = good[dim].values.copy()
    moved[3] += 0.3 * (moved[1] - moved[0])
    for bad in (good.assign_coords({dim: moved}), good.isel({dim: slice(None, None, -1)})):
        with pytest.raises(UnitError, match="evenly spaced"):
            check_mixed(bad)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_tiles_without_a_place_are_refused(value):
    good = inputs.mixed()
    moved = good.x.values.copy()
    moved[3] = value
    for bad in (good.assign_coords(x=moved), good.isel(x=[0]).assign_coords(x=[value])):
        with pytest.raises(UnitError, match="x with NaN or infinite values"):
            check_mixed(bad)


def test_photocurrent_without_channels_is_refused():
    with pytest.raises(UnitError, match="photocurrent is empty"):
        check_photocurrent(photocurrent(np.ones((0, 2, 3)), [], [0, 1, 2], [0, 1], [550.0], []))


@pytest.mark.parametrize(
    "attribute", ["f_number", "focal_length_mm", "throughput_sr", "field_width", "field_height"]
)
def test_irradiance_needs_its_attributes(attribute):
    bad = LIGHT.copy()
    del bad.attrs[attribute]
    with pytest.raises(UnitError, match=attribute):
        check_irradiance(bad)


def test_radiance_is_not_irradiance():
    with pytest.raises(UnitError, match="W m-2 nm-1"):
        check_irradiance(inputs.mixed())


def test_form_check_reads_no_light():
    bad = inputs.scene()
    bad["radiance"][0, 0, 0, 0] = np.nan
    check_scene_form(bad)


def test_grids_wider_than_150_degrees_are_refused():
    half = np.tan(np.radians(76))
    with pytest.raises(UnitError, match="76.*equidistant|equidistant"):
        scene_radiance(
            np.ones((1, 1, 2, 3)), ["sky"], [550.0], centres(3, 3 * half), centres(2, 0.2)
        )


def test_unknown_labels_are_refused():
    with pytest.raises(UnitError, match="'deph' is unknown"):
        scene_radiance(
            np.ones((1, 1, 2, 2)), ["sky"], [550.0], [-1, 1], [-1, 1], deph=np.zeros((2, 2))
        )


def test_centres_pitch_and_field_fit_together():
    x = centres(5, 2.0)
    assert x.sum() == pytest.approx(0, abs=1e-15) and np.diff(x) == pytest.approx(0.4)
    ds = inputs.scene(height=16, width=24, pitch=0.01)
    assert (tile_pitch(ds, "x"), tile_pitch(ds, "y")) == pytest.approx((0.01, 0.01))
    assert (
        full_field(ds)
        == pytest.approx((0.24, 0.16))
        == (ds.attrs["field_width"], ds.attrs["field_height"])
    )


def test_tristimulus_of_one_watt_at_555_nm():
    # 683 lm/W at the peak of V (1.0 at 555 nm in the 5 nm table); a single band counts as 1 nm wide
    one = inputs.mixed(1.0, bands=5).isel(wavelength=[2]).assign_coords(wavelength=[555.0])
    xyz = tristimulus(one)["xyz"]
    assert xyz.values[0, 0, 1] == pytest.approx(683.0, rel=1e-4)
    assert xyz.attrs["units"] == "cd m-2"
