"""Display views of a linear picture, for people and for scores of displayed pictures. Never part of
a stage.

`display` gives 8 bit sRGB. A picture and its reference picture share one white, which is stated
with each score made from it. `false_colour` gives luminance on a logarithmic scale in cd/m2.
`write_exr` and `write_png` write files for other programs: float values in cd/m2, or 16 bit with a
stated transfer function.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import UnitError, did_you_mean
from ..extras import needed
from ..physics.colour.colour_spaces import linear_srgb, srgb_codes, srgb_encode
from .tone_mapping import OPERATORS
from .white_balance import balanced

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

# a lamp is brighter than this times the 95th percentile; the whitest snow is 30 times asphalt
LAMP_MULTIPLE = 100.0
LAMP_PERCENTILE = 95.0  # lamps cover less than a twentieth of a driving scene
WHITE_PERCENTILE = 99.0
COMPRESSION = 100.0  # shows two decades below the white; see `tone`
# k1 and k2 of Mantiuk et al. 2009; see `saturation`
SATURATION_GAIN = 2.3892
SATURATION_EXPONENT = 0.8552


def lamp_mask(luminance: np.ndarray) -> np.ndarray:
    """Return which pixels (y, x) are lamps: brighter than 100 times the 95th percentile of
    `luminance`.
    """
    y = np.asarray(luminance, float)
    return y > LAMP_MULTIPLE * max(float(np.percentile(y, LAMP_PERCENTILE)), 0.0)


def white_cd_m2(truth: np.ndarray | xr.Dataset, lamps: np.ndarray | None = None) -> float:
    """Return the luminance shown as white: the 99th percentile of the reference picture without its
    lamps.

    Parameters
    ----------
    truth : reference picture: a picture Dataset or luminance (y, x), cd/m2.
    lamps : (y, x) bool, pixels that are lamps; None takes `lamp_mask`.

    Returns
    -------
    cd/m2, above 0; 1 cd/m2 for a scene without any light.
    """
    y = luminance(truth)
    white = float(np.percentile(y[white_pixels(y, lamps)], WHITE_PERCENTILE))
    return white if white > 0 else float(y.max()) if y.max() > 0 else 1.0


def white_pixels(luminance: np.ndarray, lamps: np.ndarray | None = None) -> np.ndarray:
    """Return the pixels (y, x) whose percentile is the white: all but the lamps, or all if there
    are only lamps; parameters as `white_cd_m2`.
    """
    mask = lamp_mask(luminance) if lamps is None else np.asarray(lamps, bool)
    return ~mask if not mask.all() else np.ones(mask.shape, bool)


def luminance(picture: np.ndarray | xr.Dataset) -> np.ndarray:
    """Return Y (y, x) in cd/m2 of a picture Dataset, an xyz array (y, x, 3) or a luminance array
    (y, x).
    """
    if hasattr(picture, "data_vars"):
        picture = picture["xyz"].values
    values = np.asarray(picture, float)
    if values.ndim == 3 and values.shape[-1] == 3:
        return values[..., 1]
    if values.ndim == 2:
        return values
    raise UnitError(
        f"a picture has the shape {values.shape}; expected (y, x, 3) or (y, x); pass a picture"
        " Dataset or its xyz"
    )


def tone(relative: np.ndarray, compression: float = COMPRESSION) -> np.ndarray:
    """Return displayed luminance 0..1 from luminance relative to white: log(1 + a t) / log(1 + a),
    t clipped to 0..1.

    The slope at black is a / log(1 + a), so a = 100 makes dark pixels 21.7 times brighter; a = 0 is
    linear. The curve is that of Drago et al. 2003 (equation 4) with a constant base: one pixel's
    value depends on no other pixel.
    """
    t = np.clip(relative, 0.0, 1.0)
    return t if compression == 0 else np.log1p(compression * t) / np.log1p(compression)


def saturation(relative: np.ndarray, compression: float = COMPRESSION) -> np.ndarray:
    """Return the share of colour to keep at each tone, 0..1. A picture compressed by `tone` then
    looks as colourful as the light.

    Mantiuk, Tomaszewska and Heidrich 2009, "Color correction for tone mapping", equations 3 and 4
    with the constants of the formula that keeps luminance: s = (1 + k1) c^k2 / (1 + k1 c^k2), where
    c is the slope of the curve, both axes logarithmic. A curve that compresses nothing has c = 1
    and keeps all colour.

    Parameters
    ----------
    relative : luminance relative to white, clipped to 0..1 as `tone` does.
    compression : a of `tone`.
    """
    at = compression * np.clip(relative, 0.0, 1.0)
    slope = np.divide(at, (1 + at) * np.log1p(at), out=np.ones_like(at), where=at > 1e-9)
    power = SATURATION_GAIN * slope**SATURATION_EXPONENT
    return (1 + SATURATION_GAIN) / SATURATION_GAIN * power / (1 + power)


def display(
    picture: xr.Dataset,
    white_cd_m2: float,
    compression: float = COMPRESSION,
    operator: str = "global",
    white_xyz: ArrayLike | None = None,
    natural_colour: bool = False,
) -> np.ndarray:
    """Return the picture as a display would show it: uint8 sRGB (y, x, 3).

    Luminance is mapped by `tone`. X and Z keep their ratio to Y, so the hue is kept. Values outside
    the display's gamut or range are clipped, in the view only. Invalid pixels (saturated in every
    capture) are white: their colour is unknown, but they are bright.

    Parameters
    ----------
    picture : picture Dataset or xyz (y, x, 3), cd/m2.
    white_cd_m2 : luminance shown as white; use `white_cd_m2` of the reference picture for both the
        picture and the reference picture.
    compression : a of `tone`, for "global".
    operator : "global" (`tone`), or a local operator, which depends on a pixel's surroundings:
        "exposure_fusion", "local_laplacian" (`tone_mapping`).
    white_xyz : XYZ of a white in the scene's light, which then shows as neutral (`white_balance`);
        None shows the light as it is.
    natural_colour : whether colours fade where the curve compresses (`saturation`), for "global";
        without it a compressed picture looks gaudy. Scores of appearance use pictures without it.
    """
    codes = srgb_codes(
        _linear(picture, white_cd_m2, compression, operator, white_xyz, natural_colour)
    )
    codes[_invalid(picture)] = 255
    return codes


def _within_gamut(linear: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Move linear sRGB towards the grey of its luminance until it fits into 0..1.

    Clipping each channel would turn a bright red lamp magenta, because its red is clipped and its
    blue is not.
    """
    colour = linear - grey
    above = colour.max(-1, keepdims=True)
    below = -colour.min(-1, keepdims=True)
    room = np.ones_like(grey)
    np.divide(1 - grey, above, out=room, where=above > np.maximum(1 - grey, 1e-12))
    limit = np.ones_like(grey)
    np.divide(grey, below, out=limit, where=below > np.maximum(grey, 1e-12))
    return grey + np.clip(np.minimum(room, limit), 0.0, 1.0) * colour


def _displayed(
    picture: xr.Dataset,
    white_cd_m2: float,
    compression: float,
    operator: str = "global",
    white_xyz: ArrayLike | None = None,
) -> np.ndarray:
    """Return sRGB code values 0..1 (y, x, 3); arguments as `display`."""
    rgb = srgb_encode(_linear(picture, white_cd_m2, compression, operator, white_xyz))
    rgb[_invalid(picture)] = 1.0
    return rgb


def _invalid(picture: xr.Dataset | np.ndarray) -> np.ndarray | slice:
    """Return the pixels (y, x) of a picture that are not valid; none of an array."""
    if hasattr(picture, "data_vars") and "valid" in picture:
        invalid: np.ndarray = ~picture["valid"].values
        return invalid
    return slice(0)


def _linear(
    picture: xr.Dataset,
    white_cd_m2: float,
    compression: float,
    operator: str = "global",
    white_xyz: ArrayLike | None = None,
    natural_colour: bool = False,
) -> np.ndarray:
    """Return linear sRGB (y, x, 3) of a display, before clipping; arguments as `display`."""
    if not white_cd_m2 > 0:
        raise UnitError(
            f"white_cd_m2 is {white_cd_m2!r}; expected a luminance above 0, such as"
            " display_view.white_cd_m2(truth)"
        )
    if operator not in ("global", *OPERATORS):
        raise UnitError(
            f"operator {operator!r} is unknown{did_you_mean(operator, ('global', *OPERATORS))}"
        )
    xyz = _xyz(picture) if white_xyz is None else balanced(_xyz(picture), white_xyz)
    y = luminance(xyz) / white_cd_m2
    tone_mapped = tone(y, compression) if operator == "global" else OPERATORS[operator](y)
    # where no light was found there is no hue either: noise around 0 shows as black
    gain = np.divide(tone_mapped, y, out=np.zeros_like(y), where=y > 0)
    linear = linear_srgb(xyz / white_cd_m2 * gain[..., None])
    if natural_colour and operator == "global":
        grey = (y * gain)[..., None]
        linear = grey + saturation(y, compression)[..., None] * (linear - grey)
        linear = _within_gamut(linear, grey)
    return linear


def false_colour(
    luminance_cd_m2: np.ndarray,
    low: float | None = None,
    high: float | None = None,
    colormap: str = "inferno",
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return luminance as colours on a logarithmic scale.

    Parameters
    ----------
    luminance_cd_m2 : picture Dataset, xyz (y, x, 3) or luminance (y, x), cd/m2.
    low, high : ends of the scale, cd/m2; None takes the first percentile and the largest of the
        positive values.
    colormap : a name known to matplotlib.

    Returns
    -------
    (uint8 RGB (y, x, 3), (low, high)). Values at or below 0 take the colour of `low`.
    """
    with needed("a picture in false colours", extra="report"):
        import matplotlib

    y = luminance(luminance_cd_m2)
    lit = y[y > 0]
    low = float(low if low is not None else np.percentile(lit, 1) if lit.size else 1e-3)
    high = float(high if high is not None else lit.max() if lit.size else 1.0)
    if not 0 < low <= high:
        raise UnitError(f"false colour from {low:g} to {high:g} cd/m2; expected 0 < low <= high")
    span = max(np.log(high / low), 1e-12)  # a uniform picture has no span and shows the low colour
    position = np.clip(np.log(np.maximum(y, low) / low) / span, 0.0, 1.0)
    return matplotlib.colormaps[colormap](position, bytes=True)[..., :3], (low, high)


def write_exr(picture: np.ndarray | xr.Dataset, path: Path, primaries: str = "xyz") -> Path:
    """Write a picture as OpenEXR, float32, linear, cd/m2, negative estimates kept; return the path.

    Parameters
    ----------
    picture : picture Dataset or xyz (y, x, 3), cd/m2.
    path : file to write.
    primaries : "xyz" for channels X, Y, Z; "srgb" for R, G, B with the primaries of sRGB, equal to
        Y for a D65 grey.
    """
    import OpenEXR

    xyz = _xyz(picture)
    if primaries not in ("xyz", "srgb"):
        raise UnitError(
            f"primaries {primaries!r} are unknown{did_you_mean(primaries, ('xyz', 'srgb'))}"
        )
    planes = xyz if primaries == "xyz" else linear_srgb(xyz)
    channels = {
        n: np.ascontiguousarray(planes[..., k], np.float32)
        for k, n in enumerate("XYZ" if primaries == "xyz" else "RGB")
    }
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "whiteLuminance": 1.0,
        "comments": f"linear {primaries}, cd/m2",
    }
    OpenEXR.File(header, channels).write(str(path))
    return Path(path)


@dataclass(frozen=True)
class ToneMapping:
    """How luminance is mapped to a display: parameters of `display` with the same names."""

    compression: float = COMPRESSION
    operator: str = "global"
    white_xyz: Any = None


def write_png(
    picture: xr.Dataset,
    path: Path,
    shown_white_cd_m2: float | None = None,
    transfer: str = "srgb",
    tone_mapping: ToneMapping = ToneMapping(),
) -> Path:
    """Write a picture as 16 bit PNG with a stated transfer function; return the path.

    Parameters
    ----------
    picture : picture Dataset or xyz (y, x, 3), cd/m2.
    path : file to write.
    shown_white_cd_m2 : luminance shown as white, cd/m2, for "srgb"; None takes the picture's own
        `white_cd_m2`.
    transfer : "srgb": `display` in 16 bit. "pq": absolute luminance up to 10 000 cd/m2 (SMPTE ST
        2084), primaries of sRGB; brighter values and colours outside the gamut are clipped.
    tone_mapping : parameters of `display`, for "srgb".

    Notes
    -----
    The chunk cICP (PNG third edition, ITU-T H.273 codes) and a text chunk name primaries and
    transfer function.
    """
    if transfer not in ("srgb", "pq"):
        raise UnitError(f"transfer {transfer!r} is unknown{did_you_mean(transfer, ('srgb', 'pq'))}")
    if transfer == "srgb":
        white = shown_white_cd_m2 or white_cd_m2(picture)
        mapping = tone_mapping
        is_global = mapping.operator == "global"
        how = f"tone a = {mapping.compression:g}" if is_global else f"tone {mapping.operator}"
        code = _displayed(picture, white, mapping.compression, mapping.operator, mapping.white_xyz)
        description = f"sRGB (IEC 61966-2-1), {how}, white {white:g} cd/m2" + (
            "" if mapping.white_xyz is None else ", balanced"
        )
    else:
        code = pq_encode(linear_srgb(_xyz(picture)))
        description = "PQ (SMPTE ST 2084), absolute cd/m2, primaries of sRGB"
    rows = np.rint(65535 * code).astype(">u2")
    height, width = rows.shape[:2]
    # every row starts with the number of its filter, 0: none
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)),
        (b"cICP", bytes([1, 13 if transfer == "srgb" else 16, 0, 1])),
        (b"tEXt", b"Description\0" + description.encode("latin-1")),
        (b"IDAT", zlib.compress(raw, 6)),
        (b"IEND", b""),
    ]
    path = Path(path)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
            for name, body in chunks
        )
    )
    return path


def pq_encode(cd_m2: float | np.ndarray) -> np.ndarray:
    """Return PQ code values 0..1 of absolute light, clipped to 0..10 000 cd/m2 (SMPTE ST 2084:2014,
    eq. 5.2).
    """
    y = (np.clip(cd_m2, 0.0, 10000.0) / 10000.0) ** (2610 / 16384)
    return ((3424 / 4096 + 2413 / 128 * y) / (1 + 2392 / 128 * y)) ** (2523 / 32)


def _xyz(picture: xr.Dataset) -> np.ndarray:
    values = np.asarray(picture["xyz"].values if hasattr(picture, "data_vars") else picture, float)
    if values.ndim != 3 or values.shape[-1] != 3:
        raise UnitError(
            f"a picture has the shape {values.shape}; expected (y, x, 3); pass a picture Dataset or"
            " its xyz"
        )
    return values
