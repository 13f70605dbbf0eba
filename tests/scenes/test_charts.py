"""Charts: luminances, areas and reflectances against independent computations."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from isethdr_scenes import COMPONENTS
from isethdr_scenes.charts import coverage
from isethdr_scenes.charts.luminance_ramp import LuminanceRamp
from isethdr_scenes.charts.macbeth import Macbeth
from isethdr_scenes.charts.moving_target import MovingTarget
from isethdr_scenes.charts.point_lights import PointLights
from isethdr_scenes.charts.slanted_edge import SlantedEdge
from isethdr_scenes.charts.uniform import Uniform

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance, xyz

FLOAT32 = 6e-8  # relative rounding of radiance, which is stored as float32
CHARTS = sorted({c.cls for c in COMPONENTS if ".charts." in c.target}, key=lambda c: c.__name__)


def seen(ds):
    return luminance(ds.radiance.values.astype(float).sum(0), ds.wavelength.values)


@pytest.mark.parametrize("cls", CHARTS)
def test_every_chart_is_scene_radiance_on_its_field(cls):
    ds = cls(width=64, height=32, horizontal_field_deg=30.0)()
    quantities.check_scene(ds)
    assert ds.attrs["field_width"] == pytest.approx(2 * np.tan(np.radians(15)), rel=1e-12)
    assert ds.attrs["field_height"] == pytest.approx(ds.attrs["field_width"] / 2, rel=1e-12)
    assert list(ds.wavelength.values) == list(range(400, 701, 10))
    assert "sky" in ds.light_group.values
    for row in ds.attrs["objects"]:
        left, top, width, height = row["box"]
        inside = ds.instance.values == row["instance"]
        rows, columns = np.nonzero(inside)
        # boxes agree to a tile, since a tile belongs to the part that covers half of it, or more
        # than any other part
        assert abs(columns.min() - left) <= 1 and abs(columns.max() + 1 - left - width) <= 1
        assert abs(rows.min() - top) <= 1 and abs(rows.max() + 1 - top - height) <= 1


@pytest.mark.parametrize("spectrum", ["D65", "A", "E"])
@pytest.mark.parametrize("bands", [(400.0, 700.0, 10.0), (380.0, 780.0, 5.0), (555.0, 555.0, 10.0)])
def test_uniform_has_its_luminance_whatever_the_bands(spectrum, bands):
    ds = Uniform(4, 3, 10.0, 1234.5, *bands, spectrum)()
    np.testing.assert_allclose(seen(ds), 1234.5, rtol=FLOAT32)


@pytest.mark.parametrize(
    ("spectrum", "x", "y"),
    [("D65", 0.31272, 0.32903), ("A", 0.44757, 0.40745), ("E", 1 / 3, 1 / 3)],
)
def test_illuminants_have_their_chromaticity(spectrum, x, y):
    """CIE 15: chromaticities of the 1931 observer; 2e-4 for sums at 5 nm from 380 to 780 nm."""
    ds = Uniform(1, 1, first_nm=380.0, last_nm=780.0, step_nm=5.0, spectrum=spectrum)()
    values = xyz(ds.radiance.values[0, :, 0, 0].astype(float), ds.wavelength.values)
    assert values[:2] / values.sum() == pytest.approx([x, y], abs=2e-4)


def test_ramp_ends_and_ratios():
    y = seen(LuminanceRamp(width=257, height=2, luminance_cd_m2=1e6, decades=8.0)())
    np.testing.assert_allclose(y[:, 0], 1e-2, rtol=FLOAT32)
    np.testing.assert_allclose(y[:, -1], 1e6, rtol=FLOAT32)
    np.testing.assert_allclose(y[:, 1:] / y[:, :-1], 10 ** (8 / 256), rtol=3 * FLOAT32)


@pytest.mark.parametrize("angle", [0.0, 1e-5, 5.0, 45.0, 80.0, 90.0, 135.0, 180.0])
def test_half_plane_agrees_with_counting_points(angle):
    x = quantities.centres(7, 7.0)
    y = quantities.centres(5, 5.0)
    pitch = 1.0
    cover = coverage.half_plane(x, y, pitch, angle)
    fine = (np.arange(400) + 0.5) / 400 - 0.5
    px = (x[:, None] + fine).ravel()
    py = (y[:, None] + fine).ravel()
    counted = np.cos(np.radians(angle)) * px[None] + np.sin(np.radians(angle)) * py[:, None] > 0
    counted = counted.reshape(5, 400, 7, 400).mean((1, 3))
    # 400 points per side: a line misplaces less than one point per row, 1/400, and half of that on
    # average
    assert np.abs(cover - counted).max() < 2.5e-3
    # a line through the centre halves a symmetric grid; four squared terms cancel to 1e-16 /
    # tan(angle)
    assert cover.mean() == pytest.approx(0.5, abs=1e-10)


@pytest.mark.parametrize("angle", [0.0, 5.0, 30.0])
def test_slanted_edge_mean_sides_and_slope(angle):
    ds = SlantedEdge(
        width=60, height=40, angle_deg=angle, contrast_ratio=20.0, luminance_cd_m2=200.0
    )()
    y = seen(ds)
    assert y.mean() == pytest.approx((200 + 10) / 2, rel=FLOAT32)
    assert y.max() == pytest.approx(200, rel=FLOAT32) and y.min() == pytest.approx(10, rel=FLOAT32)
    if angle == 5.0:  # edge in each row: sum of dark shares of tiles
        edge = ((200 - y) / 190).sum(1)
        # the edge is turned clockwise: lower rows have it farther left
        np.testing.assert_allclose(np.diff(edge), -np.tan(np.radians(5.0)), rtol=1e-5)


def test_disc_area_whatever_its_size_and_place():
    x = quantities.centres(11, 1.1)
    y = quantities.centres(9, 0.9)
    pitch = 0.1
    for radius, cx, cy in (
        (0.3, 0.0, 0.0),
        (0.31, 0.017, -0.023),
        (0.02, 0.05, 0.05),
        (1e-5, 0.2, 0.1),
        (0.05, 0.0, 0.0),
    ):
        cover = coverage.disc(x, y, pitch, cx, cy, radius)
        assert cover.sum() * pitch**2 == pytest.approx(np.pi * radius**2, rel=1e-10)
        assert cover.min() >= 0 and cover.max() <= 1
    # 1e-12 for a disc larger than the field: rounding of its area, 1e-16, times 50^2 tiles per
    # squared radius
    assert coverage.disc(x, y, pitch, 0.0, 0.0, 5.0).min() == pytest.approx(1.0, abs=1e-12)
    # a disc centred on a corner of four tiles gives a quarter to each
    four = coverage.disc(x, y, pitch, 0.05, 0.05, 0.02)
    np.testing.assert_allclose(
        four[four > 0], np.full(4, np.pi * 0.02**2 / 4 / pitch**2), rtol=1e-12
    )
    # compare with counted points
    fine = (np.arange(200) + 0.5) / 200 * pitch - pitch / 2
    inside = ((x[:, None] + fine).ravel() - 0.017) ** 2 + (
        (y[:, None] + fine).ravel()[:, None] + 0.023
    ) ** 2 < 0.31**2
    counted = inside.reshape(9, 200, 11, 200).mean((1, 3))
    # the circle crosses a tile in at most two arcs, and each misplaces less than one point per row
    # of 200
    assert np.abs(coverage.disc(x, y, pitch, 0.017, -0.023, 0.31) - counted).max() < 5e-3


@pytest.mark.parametrize("diameter_deg", [0.05, 0.5, 2.0])
def test_point_lights_hold_their_energy(diameter_deg):
    chart = PointLights(width=200, height=60, disc_diameter_deg=diameter_deg, luminance_cd_m2=1e6)
    ds = chart()
    pitch = quantities.tile_pitch(ds, "x")
    lamps = luminance(
        ds.radiance.sel(light_group="headlights").values.astype(float), ds.wavelength.values
    )
    area = np.pi * np.tan(np.radians(diameter_deg / 2)) ** 2
    energy = lamps.reshape(60, 5, 40).sum((0, 2)) * pitch**2  # a fifth of the width per disc
    # 1e-6: rounding of tiles to float32
    np.testing.assert_allclose(energy, [area * 10.0 ** (6 - k) for k in range(5)], rtol=1e-6)
    sky = luminance(ds.radiance.sel(light_group="sky").values.astype(float), ds.wavelength.values)
    assert sky.sum() * pitch**2 == pytest.approx(0.1 * (200 * 60 * pitch**2 - 5 * area), rel=1e-6)
    assert [lamp["luminance_cd_m2"] for lamp in ds.attrs["lamps"]] == pytest.approx(
        [1e6, 1e5, 1e4, 1e3, 1e2]
    )
    if diameter_deg == 2.0:  # full tiles inside show exactly the disc
        assert lamps.max() == pytest.approx(1e6, rel=FLOAT32)


def test_macbeth_patches_reflect_what_they_should():
    chart = Macbeth(width=60, height=40, luminance_cd_m2=500.0)
    ds = chart()
    names, reflectance = chart.reflectances()
    assert (
        len(names) == 24
        and reflectance.shape == (24, 31)
        and reflectance.min() > 0
        and reflectance.max() < 1
    )
    white = Uniform(1, 1, luminance_cd_m2=500.0)().radiance.values[0, :, 0, 0]
    for k in range(24):
        middle = ds.radiance.values[0, :, 5 + 10 * (k // 6), 5 + 10 * (k % 6)]
        np.testing.assert_allclose(middle, white * reflectance[k], rtol=3 * FLOAT32)
        assert ds.instance.values[5 + 10 * (k // 6), 5 + 10 * (k % 6)] == k + 1
    # the grey row is specified by its densities: 0.05 (white), 0.23, 0.44, 0.70, 1.05, 1.50; prints
    # keep them to 10 %
    np.testing.assert_allclose(
        seen(ds)[35, 5::10] / 500, 10.0 ** -np.array([0.05, 0.23, 0.44, 0.70, 1.05, 1.50]), rtol=0.1
    )


def test_uniform_d65_agrees_with_isetcam():
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set: reference numbers are not part of the project")
    data = np.load(Path(folder) / "isetcam" / "a_photometry.npz")
    ours = Uniform(1, 1)().radiance.values[0, :, 0, 0].astype(float)
    fine = data["d65_w5"][np.searchsorted(data["wave5"], np.arange(395, 706, 5))]
    # mean over 10 nm of the linear interpolation between values at 5 nm
    theirs = (fine[:-2:2] + 2 * fine[1:-1:2] + fine[2::2]) / 4
    # 1e-3: ISETCam's D65 differs from the CIE table by a slope of 1.3e-3 from 380 to 780 nm; values
    # at the centres of bands instead of means would differ by 4 %
    np.testing.assert_allclose(ours / ours.mean(), theirs / theirs.mean(), rtol=1e-3)


@pytest.mark.parametrize(
    ("cls", "fields", "match"),
    [
        (Uniform, {"luminance_cd_m2": -1.0}, "expected 0 to 1e"),
        (Uniform, {"luminance_cd_m2": float("nan")}, "is nan"),
        (Uniform, {"width": 0}, "expected 1 to"),
        (Uniform, {"horizontal_field_deg": 180.0}, "at most 150"),
        (Uniform, {"step_nm": 0.0}, "step_nm is 0.0; expected 0.1"),
        (Uniform, {"first_nm": 700.0, "last_nm": 400.0}, "not a grid"),
        (SlantedEdge, {"contrast_ratio": 0.5}, "expected 1 to"),
        (PointLights, {"disc_diameter_deg": 20.0}, "do not fit"),
        (PointLights, {"background_cd_m2": -1.0}, "expected 0 to"),
        (LuminanceRamp, {"decades": 0.0}, "expected 0.001 to"),
        (Macbeth, {"gap": 1.0}, "expected 0 to 0.99"),
        # micrometres and metres, taken for nanometres
        (Uniform, {"first_nm": 0.4, "last_nm": 0.7}, "first_nm is 0.4; expected 100 to 3000"),
        (Uniform, {"last_nm": 7e-7}, "last_nm is 7e-07; expected 100 to 3000"),
    ],
)
def test_impossible_charts_are_config_errors(cls, fields, match):
    with pytest.raises(ConfigError, match=match):
        cls(**fields)


def test_invisible_bands_are_an_error():
    with pytest.raises(ConfigError, match="no visible light"):
        Uniform(2, 2, first_nm=900.0, last_nm=1000.0)()


@pytest.mark.parametrize("name", ["D50", "D55", "D65", "D75"])
def test_daylight_is_that_of_the_published_tables(name):
    import colour
    from isethdr_scenes.charts.daylight import DAYLIGHT_K, daylight

    published = colour.SDS_ILLUMINANTS[name]
    nm = published.wavelengths[published.wavelengths >= 360]
    # 0.02: tables are printed with two or three decimals, relative to 100, and colour-science
    # interpolates between their values by another rule
    np.testing.assert_allclose(daylight(DAYLIGHT_K[name])(nm), published[nm], atol=0.02)


@pytest.mark.slow
def test_own_daylight_is_worth_its_lines():
    """A process computes daylight from the project's own tables in less than half the time that
    colour-science takes.

    Otherwise colour-science should replace the tables.
    """
    code = """
import time
import numpy as np
from isethdr_scenes.charts.daylight import DAYLIGHT_K, daylight
nm = np.arange(380.0, 781.0)
start = time.process_time()
ours = daylight(DAYLIGHT_K["D65"])(nm)
between = time.process_time()
from colour.colorimetry import sd_CIE_illuminant_D_series
from colour.temperature import CCT_to_xy_CIE_D
theirs = sd_CIE_illuminant_D_series(CCT_to_xy_CIE_D(DAYLIGHT_K["D65"]), M1_M2_rounding=True)
theirs = np.interp(nm, theirs.wavelengths, theirs.values)
end = time.process_time()
print(between - start, end - between, abs(ours / theirs - 1).max())
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True
    )
    ours_s, theirs_s, difference = map(float, done.stdout.split())
    assert ours_s < 0.5 * theirs_s
    assert difference < 1e-12  # the same formula of the CIE, in another order of operations


@pytest.mark.parametrize("projection", ["tangent", "equidistant"])
def test_sizes_are_angles_in_both_projections(projection):
    """Sizes on a chart are angles in both projections.

    In a field of 40 degrees, a disc of 20 degrees covers a share of the row that is the ratio of
    the angles (equidistant) or of their tangents (tangent).
    """
    wide = PointLights(
        width=400,
        height=200,
        projection=projection,
        horizontal_field_deg=40.0,
        disc_diameter_deg=20.0,
        discs=1,
    )()
    tangent = lambda angle_deg: math.tan(math.radians(angle_deg))
    radius_px = 200 * (tangent(10) / tangent(20) if projection == "tangent" else 0.5)
    lamp = luminance(wide.radiance.sel(light_group="headlights").values, wide.wavelength.values)
    # 1e-5: radiance is float32, while the coverage of tiles is exact
    assert lamp.sum() / lamp.max() == pytest.approx(math.pi * radius_px**2, rel=1e-5)
    bar = MovingTarget(
        width=400, height=20, projection=projection, horizontal_field_deg=40.0, bar_width_deg=20.0
    )()
    # boxes end at whole tiles
    assert bar.attrs["objects"][0]["box"][2] == pytest.approx(2 * radius_px, abs=1)


def test_a_target_that_leaves_the_frame_has_a_cut_box_and_then_no_row():
    shown = lambda time_s: MovingTarget(time_s=time_s)().attrs["objects"]
    start = shown(0.0)
    assert [one["visible_fraction"] for one in start] == [1.0, 1.0]
    left, _, width, _ = start[0]["box"]
    # 600 tiles per second: half of the bar is beyond the last of 320 columns
    (bar,) = shown((320 - left - width / 2) / 600)
    assert bar["box"][2] == pytest.approx(width / 2) and sum(bar["box"][::2]) == 320
    assert bar["visible_fraction"] == pytest.approx(0.5)
    assert shown(1.0) == []
