"""Sensor and isp together: a uniform grey comes back in cd/m2 through every sensor, over nine
decades.
"""

import numpy as np
import pytest
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.physics.radiometry import cos4_falloff
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)
THROUGHPUT = np.pi / 65
FOCAL_MM = 4.0


def irradiance(level, shape=(40, 40), tile_um=1.0, pitch_um=3.0):
    """Return the irradiance of a uniform daylight grey of `level` cd/m2 behind a cos^4 lens at
    f/4.
    """
    ny, nx = (round(n * pitch_um / tile_um) for n in shape)
    x = centres(nx, nx * tile_um * 1e-6)
    y = centres(ny, ny * tile_um * 1e-6)
    fall = cos4_falloff(x[None], y[:, None], FOCAL_MM * 1e-3)
    return plane(
        level * THROUGHPUT * white("daylight", W)[:, None, None] * fall,
        W,
        x,
        y,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=FOCAL_MM,
        throughput_sr=THROUGHPUT,
        falloff="cos4",
        field_width=nx * tile_um * 1e-6,
        field_height=ny * tile_um * 1e-6,
    )


@pytest.mark.parametrize("isp", ["ideal", "linear", "merge"])
@pytest.mark.parametrize("cfa", ["RGGB", "RG/WB", "W"])
@pytest.mark.parametrize("level", [1e-3, 1e6])
def test_ideal_sensor_gives_the_level_back_exactly(isp, cfa, level):
    shot = hdr.build("sensor", "ideal", pitch_um=3.0, cfa=cfa)(irradiance(level))
    picture = hdr.build("isp", isp)(shot)
    # 1e-6: raw is float32 (1.2e-7), and the colour matrix amplifies by at most 4
    np.testing.assert_allclose(picture.xyz.values[..., 1], level, rtol=1e-6)
    assert picture.valid.values.all()


@pytest.mark.parametrize("level", [0.1, 10.0, 1000.0, 3e4])
def test_split_pixel_is_unbiased_and_its_variance_is_right(level):
    sensor = hdr.build(
        "sensor",
        "split_pixel",
        pitch_um=3.0,
        prnu=(0.0, 0.0),
        dark_spread=(0.0, 0.0),
        column_e=(0.0, 0.0, 0.0),
    )
    picture = hdr.build("isp", "merge")(
        sensor(irradiance(level, (120, 120)), hdr.generator(seed=3))
    )
    y = picture.xyz.values[2:-2, 2:-2, 1]
    variance = picture.variance.values[2:-2, 2:-2, 1]
    assert picture.valid.values.all()
    # 4 standard errors; neighbours are correlated, so a standard error is 2.7 times that of 13 456
    # independent pixels
    assert abs(y.mean() - level) < 4 * 2.7 * y.std() / np.sqrt(y.size) + 1e-3 * level
    assert variance.mean() == pytest.approx(y.var(), rel=0.1)  # 13 456 dependent pixels: 3 %
    if level == 1000.0:
        assert np.sqrt(y.var()) / level < 0.02


def test_beyond_the_small_photodiode_is_not_valid():
    sensor = hdr.build("sensor", "split_pixel", pitch_um=3.0)
    picture = hdr.build("isp", "merge")(sensor(irradiance(1e8), hdr.generator()))
    assert not picture.valid.values.any() and np.isfinite(picture.xyz.values).all()


@pytest.mark.parametrize("level", [1.0, 300.0])
def test_companded_sensor_comes_back_in_level_and_variance(level):
    """16 bits are companded to 12: above the first knee, a code is 14 or 48 linear DN wide."""
    knees = ((2048, 2048), (16384, 3072), (65535, 4095))
    sensor = hdr.build(
        "sensor",
        "bayer",
        pitch_um=3.0,
        prnu=0.0,
        dark_spread=0.0,
        column_e=0.0,
        bits=16,
        companding=knees,
    )
    shot = sensor(irradiance(level, (100, 100)), hdr.generator(seed=3))
    assert shot.raw.values.max() < 4096
    picture = hdr.build("isp", "linear")(shot)
    y = picture.xyz.values[2:-2, 2:-2, 1]
    variance = picture.variance.values[2:-2, 2:-2, 1]
    # as for the split pixel above
    assert abs(y.mean() - level) < 4 * 2.7 * y.std() / np.sqrt(y.size) + 1e-3 * level
    assert variance.mean() == pytest.approx(y.var(), rel=0.1)


def test_merge_of_the_split_pixel_says_where_each_pixel_comes_from():
    sensor = hdr.build("sensor", "split_pixel", pitch_um=3.0, cfa="W")
    captures = {
        level: hdr.build("isp", "merge")(sensor(irradiance(level), hdr.generator(seed=1)))
        for level in (1.0, 3e4)
    }
    # capture 1 is LPHG, capture 2 is SPLG
    assert (captures[1.0]["source"].values == 1).all() and (
        captures[3e4]["source"].values == 2
    ).all()
