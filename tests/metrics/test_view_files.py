"""Files of the display view, read back by other programs: EXR and 16 bit PNG."""

import numpy as np
import pytest

from isethdr_core.display import display_view
from isethdr_core.errors import UnitError
from isethdr_core.physics.colour.colour_spaces import D65_XYZ, linear_srgb
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture


def picture():
    y = np.geomspace(1e-3, 1e6, 24 * 16).reshape(16, 24)
    y[3, 4] = -0.5
    xyz = y[..., None] * D65_XYZ
    return make_picture(
        xyz,
        np.zeros_like(xyz),
        np.ones(y.shape, bool),
        centres(24, 1e-4),
        centres(16, 1e-4),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


@pytest.mark.parametrize(("primaries", "channels"), [("xyz", "XYZ"), ("srgb", "RGB")])
def test_exr_holds_absolute_float_light(tmp_path, primaries, channels):
    import OpenEXR

    p = picture()
    with OpenEXR.File(
        str(display_view.write_exr(p, tmp_path / "a.exr", primaries)), separate_channels=True
    ) as file:
        seen = np.stack([file.channels()[c].pixels for c in channels], -1)
    assert seen.dtype == np.float32
    expected = p["xyz"].values if primaries == "xyz" else linear_srgb(p["xyz"].values)
    np.testing.assert_allclose(seen, expected, rtol=1e-6)  # float32
    # a D65 grey is R = G = B = Y; the matrix of the standard has four digits
    if primaries == "srgb":
        np.testing.assert_allclose(seen[..., 1], p["xyz"].values[..., 1], rtol=1e-3)


def test_png_has_16_bits_and_says_its_transfer_function(tmp_path):
    import matplotlib.image

    p = picture()
    file = display_view.write_png(p, tmp_path / "a.png", 100.0)
    raw = file.read_bytes()
    assert b"sRGB" in raw and b"white 100 cd/m2" in raw and raw[24] == 16
    assert raw[raw.index(b"cICP") + 4 :][:4] == bytes([1, 13, 0, 1])
    # rounded to 8 bits, the values that a reader gets are those of `display`
    seen = matplotlib.image.imread(file)
    np.testing.assert_allclose(np.rint(255 * seen[..., :3]), display_view.display(p, 100.0), atol=1)
    from PIL import Image

    assert Image.open(file).size == (24, 16)


def test_png_in_pq_is_absolute(tmp_path):
    p = picture()
    raw = display_view.write_png(p, tmp_path / "a.png", transfer="pq").read_bytes()
    assert b"ST 2084" in raw and raw[raw.index(b"cICP") + 4 :][:4] == bytes([1, 16, 0, 1])


def test_pq_is_that_of_the_standard():
    import colour

    levels = np.array([0.0, 0.005, 1.0, 100.0, 1000.0, 10000.0])
    np.testing.assert_allclose(
        display_view.pq_encode(levels), colour.models.eotf_inverse_ST2084(levels), atol=1e-12
    )
    assert (
        display_view.pq_encode(-1.0) == display_view.pq_encode(0.0)
        and display_view.pq_encode(1e6) == 1.0
    )


def test_bad_names_and_shapes_are_named(tmp_path):
    with pytest.raises(UnitError, match="primaries 'xyy'.*xyz"):
        display_view.write_exr(picture(), tmp_path / "a.exr", "xyy")
    with pytest.raises(UnitError, match="transfer 'PQ'"):
        display_view.write_png(picture(), tmp_path / "a.png", transfer="PQ")
    with pytest.raises(UnitError, match="shape"):
        display_view.write_exr(np.ones((4, 4)), tmp_path / "a.exr")
