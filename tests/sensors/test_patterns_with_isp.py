"""Filter arrays together with an isp: a grey comes back in cd/m2 under every pattern that the
sensors offer.
"""

import numpy as np
import pytest
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)
THROUGHPUT = np.pi / 65
PATTERNS = {
    "Bayer": ("RGGB", "BGGR", "GRBG", "GBRG"),
    "clear 2 x 2": ("RG/WB", "RCCB", "RCCC", "RYYC"),
    "RGBW 4 x 4": ("WGWR/GWRW/WBWG/BWGW",),
    "quad Bayer": ("RRGG/RRGG/GGBB/GGBB",),
    "monochrome": ("W",),
}
ALL = [cfa for patterns in PATTERNS.values() for cfa in patterns]


def grey(level, size=48, pitch_um=3.75):
    """Return the irradiance of a uniform grey of `level` cd/m2 in daylight, at f/4, without
    falloff.
    """
    pitch = pitch_um * 1e-6
    at = centres(size, size * pitch)
    values = level * THROUGHPUT * white("daylight", W)[:, None, None] * np.ones((1, size, size))
    return plane(
        values,
        W,
        at,
        at,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=THROUGHPUT,
        falloff="none",
        field_width=size * pitch,
        field_height=size * pitch,
    )


@pytest.mark.parametrize("cfa", ALL)
@pytest.mark.parametrize("crosstalk", [0.0, 5.0])
def test_grey_comes_back_without_noise(cfa, crosstalk):
    sensor = hdr.build(
        "sensor", "single", cfa=cfa, noise=False, bits=0, optical_crosstalk_percent=crosstalk
    )
    picture = hdr.build("isp", "linear")(sensor(grey(100.0), None))
    y = picture.xyz.values[..., 1]
    # raw is float32. With crosstalk, pixels of one channel differ where their neighbours differ;
    # their mean does not change
    np.testing.assert_allclose(y[8:-8, 8:-8].mean(), 100.0, rtol=1e-6)
    if not crosstalk:
        np.testing.assert_allclose(y, 100.0, rtol=3e-6)
    assert picture.valid.values.all()


@pytest.mark.parametrize("cfa", ALL)
def test_grey_comes_back_with_all_noise(cfa):
    sensor = hdr.build("sensor", "single", cfa=cfa)
    picture = hdr.build("isp", "linear")(sensor(grey(100.0), hdr.generator(3)))
    y = picture.xyz.values[..., 1]
    # 5 standard errors, plus 0.05 % for PRNU and column noise; neighbours share samples, so only
    # about 1 / 16 of the 48 x 48 pixels count as independent
    assert abs(y.mean() / 100 - 1) < 5 * y.std() / 100 / np.sqrt(y.size / 16) + 5e-4
    assert abs(y.mean() / 100 - 1) < 0.02
    assert picture.valid.values.all()


def test_companded_captures_come_back():
    sensor = hdr.build(
        "sensor", "bayer", companding=((512.0, 512.0), (1536.0, 768.0), (4095.0, 1023.0))
    )
    y = hdr.build("isp", "linear")(sensor(grey(500.0), hdr.generator(3))).xyz.values[..., 1]
    plain = hdr.build("isp", "linear")(
        hdr.build("sensor", "bayer")(grey(500.0), hdr.generator(3))
    ).xyz.values[..., 1]
    # 2e-3: both have the same noise, and companding rounds to steps of up to 10 codes
    assert abs(y.mean() / plain.mean() - 1) < 2e-3


@pytest.mark.parametrize(
    "name, isp",
    [
        ("dual_gain", "merge"),
        ("staggered", "merge"),
        ("interleaved", "linear"),
        ("split_pixel", "merge"),
    ],
)
@pytest.mark.parametrize("level", [30.0, 300.0])
def test_every_architecture_gives_the_level_back(name, isp, level):
    picture = hdr.build("isp", isp)(
        hdr.build("sensor", name)(grey(level, 60, 3.75), hdr.generator(3))
    )
    y = picture.xyz.values[..., 1]
    assert abs(y.mean() / level - 1) < 5 * y.std() / level / np.sqrt(y.size / 16) + 2e-3
    assert picture.valid.values.mean() > 0.99
