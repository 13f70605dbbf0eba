"""Colour: XYZ to linear and encoded sRGB, CIELAB, colour differences, and the matrix from a sensor
to XYZ.

The last axis of every argument holds the three values. XYZ may have any scale, but for sRGB white
must have Y = 1. Functions that work pixel by pixel process pictures in pieces, so that intermediate
results stay in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# IEC 61966-2-1:1999, the four-digit matrix of the standard
XYZ_TO_SRGB = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)
D65_XYZ = np.array([0.95047, 1.0, 1.08883])  # white of sRGB, Y = 1
PIECE = 16384  # number of pixels of a piece
CODE_BINS = 2**16  # number of entries of the table of 8 bit codes


def _in_pieces(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that applies `function` to large arrays (..., 3) in pieces. `function` must
    work pixel by pixel; the values are then the same bit for bit.
    """

    @wraps(function)
    def over_pieces(*arrays: ArrayLike) -> np.ndarray:
        arrays = [np.asarray(a) for a in arrays]
        lead = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
        count = int(np.prod(lead))
        if count <= PIECE:
            return function(*arrays)
        flat = [
            np.broadcast_to(a, (*lead, a.shape[-1])).reshape(count, -1) if a.ndim > 1 else a
            for a in arrays
        ]
        out = None
        for start in range(0, count, PIECE):
            part = slice(start, start + PIECE)
            result = function(*(a[part] if a.ndim > 1 else a for a in flat))
            out = np.empty((count, *result.shape[1:]), result.dtype) if out is None else out
            out[part] = result
        return out.reshape(*lead, *out.shape[1:])

    return over_pieces


def linear_srgb(xyz: np.ndarray) -> np.ndarray:
    """Return linear sRGB from XYZ with Y = 1 for white; neither clipped nor encoded."""
    return np.asarray(xyz) @ XYZ_TO_SRGB.T


def xyz_from_linear_srgb(rgb: np.ndarray) -> np.ndarray:
    """Return XYZ from linear sRGB: the exact inverse of `linear_srgb`."""
    return np.asarray(rgb) @ np.linalg.inv(XYZ_TO_SRGB).T


@_in_pieces
def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """Return sRGB code values 0..1 from linear values, which are first clipped to 0..1 (IEC
    61966-2-1:1999).
    """
    v = np.clip(linear, 0.0, 1.0)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


@_in_pieces
def srgb_codes(linear: np.ndarray) -> np.ndarray:
    """Return 8 bit sRGB codes: 255 `srgb_encode(linear)`, rounded, in a fraction of the time.

    Linear values are looked up in a table. Those of table entries with a step between two codes are
    encoded.
    """
    v = np.clip(linear, 0.0, 1.0)
    # v = 1 takes the last entry
    codes = np.asarray(_code_table().take((v * CODE_BINS).astype(np.int32), mode="clip"))
    near_step = np.flatnonzero(codes < 0)
    codes.flat[near_step] = np.rint(255 * srgb_encode(v.flat[near_step]))
    return codes.astype(np.uint8)


@cache
def _code_table() -> np.ndarray:
    """Return the 8 bit sRGB code of each of `CODE_BINS` equal ranges of linear values within 0..1,
    and -1 for ranges with a step between two codes.
    """
    codes = 255 * srgb_encode(np.arange(CODE_BINS + 1) / CODE_BINS)
    rounding = 1e-9  # larger than the rounding errors of a code
    low = np.rint(codes[:-1] - rounding)
    high = np.rint(codes[1:] + rounding)
    return np.where(low == high, low, -1).astype(np.int16)


def srgb_decode(code: np.ndarray) -> np.ndarray:
    """Return linear values 0..1 from sRGB code values 0..1."""
    v = np.clip(code, 0.0, 1.0)
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


@_in_pieces
def lab(xyz: np.ndarray, white_xyz: np.ndarray) -> np.ndarray:
    """Return CIELAB (CIE 015:2018, 8.2.1) of XYZ against a white of the same scale.

    The linear branch is also used for negative values, so that noise around black stays around
    L* = 0.
    """
    t = np.asarray(xyz, float) / np.asarray(white_xyz, float)
    edge = 6 / 29
    f = np.where(t > edge**3, np.cbrt(np.maximum(t, edge**3)), t / (3 * edge**2) + 4 / 29)
    x = f[..., 0]
    y = f[..., 1]
    z = f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def de76(lab_1: np.ndarray, lab_2: np.ndarray) -> np.ndarray:
    """Return the CIE 1976 colour difference, the distance in CIELAB."""
    return np.sqrt(np.sum((np.asarray(lab_1) - np.asarray(lab_2)) ** 2, -1))


def de94(lab_reference: np.ndarray, lab_sample: np.ndarray) -> np.ndarray:
    """Return the CIE 1994 colour difference for graphic arts (CIE 116:1995). It is not symmetric:
    the weights are those of the reference.
    """
    l1, a1, b1 = _unpack(lab_reference)
    l2, a2, b2 = _unpack(lab_sample)
    c1 = np.hypot(a1, b1)
    c2 = np.hypot(a2, b2)
    # rounding may make it slightly negative
    dh2 = np.maximum((a1 - a2) ** 2 + (b1 - b2) ** 2 - (c1 - c2) ** 2, 0.0)
    return np.sqrt(
        (l1 - l2) ** 2 + ((c1 - c2) / (1 + 0.045 * c1)) ** 2 + dh2 / (1 + 0.015 * c1) ** 2
    )


@_in_pieces
def de2000(lab_1: np.ndarray, lab_2: np.ndarray) -> np.ndarray:
    """Return the CIEDE2000 colour difference with kL = kC = kH = 1 (Sharma, Wu, Dalal 2005,
    equations 2-22).
    """
    l1, a1, b1 = _unpack(lab_1)
    l2, a2, b2 = _unpack(lab_2)
    stretch = 1 + 0.5 * (
        1 - np.sqrt(_chromatic((np.sqrt(a1 * a1 + b1 * b1) + np.sqrt(a2 * a2 + b2 * b2)) / 2))
    )
    a1 = a1 * stretch
    a2 = a2 * stretch
    c1 = np.sqrt(a1 * a1 + b1 * b1)
    c2 = np.sqrt(a2 * a2 + b2 * b2)
    dh, cos, sin = _hues(a1, b1, c1, a2, b2, c2)
    mean_l = (l1 + l2) / 2
    mean_c = (c1 + c2) / 2
    cos2 = 2 * cos * cos - 1
    sin2 = 2 * sin * cos
    t = 1 + 0.24 * cos2  # and cos(h - 30), cos(3 h + 6), cos(4 h - 63) by the sums of angles
    for size, of_cos, of_sin, degrees in (
        (-0.17, cos, sin, -30),
        (0.32, cos2 * cos - sin2 * sin, sin2 * cos + cos2 * sin, 6),
        (-0.20, 2 * cos2 * cos2 - 1, 2 * sin2 * cos2, -63),
    ):
        t += (
            size * np.cos(np.radians(degrees)) * of_cos
            - size * np.sin(np.radians(degrees)) * of_sin
        )
    from_50 = (mean_l - 50) ** 2
    s_l = 1 + 0.015 * from_50 / np.sqrt(20 + from_50)
    s_c = 1 + 0.045 * mean_c
    s_h = 1 + 0.015 * mean_c * t
    mean_h = np.degrees(np.arctan2(sin, cos))
    # 0 rounded to a negative value must not become 360, because `turn` below would differ
    mean_h += 360 * (mean_h < -1e-12)
    turn = (
        2
        * np.sqrt(_chromatic(mean_c))
        * -np.sin(np.radians(60 * np.exp(-(((mean_h - 275) / 25) ** 2))))
    )
    dl = (l2 - l1) / s_l
    dc = (c2 - c1) / s_c
    dh = dh / s_h
    return np.sqrt(dl**2 + dc**2 + dh**2 + turn * dc * dh)


def colour_matrix(
    response: np.ndarray,
    xyz: np.ndarray,
    white_response: ArrayLike,
    white_xyz: ArrayLike,
    noise_covariance: float | np.ndarray = 0.0,
) -> np.ndarray:
    """Return the matrix (3, channel) from a sensor's responses to XYZ that is exact for one white
    and a least-squares fit for other colours.

    White-preserving least squares (Finlayson, Drew 1997): M minimises sum |M s - t|^2 + trace(M N
    M^T) over the samples, with the constraint M white_response = white_xyz. With one channel, the
    constraint alone determines M = white_xyz / white_response.

    Parameters
    ----------
    response : (sample, channel) responses s; the scale of a sample sets its weight.
    xyz : (sample, 3) XYZ t of the same samples, with the same scale.
    white_response, white_xyz : (channel,) and (3,) values of the white that is exact.
    noise_covariance : (channel, channel) N, the covariance of the noise of one response times the
        number of samples; 0 for no noise.
    """
    s = np.asarray(response, float)
    t = np.asarray(xyz, float)
    u = np.asarray(white_response, float)
    v = np.asarray(white_xyz, float)
    noise = np.broadcast_to(noise_covariance, (len(u), len(u)))
    # signal and noise of channels differ by decades: each channel is scaled by its own signal and
    # noise
    size = np.sqrt(np.sum(s**2, axis=0) + np.diag(noise))
    size = np.where(size > 0, size, 1.0)
    s = s / size
    u = u / size
    noise = noise / np.outer(size, size)
    # one matrix that maps the white; the rest of the solution lies in its null space
    base = np.outer(v, u) / np.sum(u**2)
    free = np.linalg.svd(u[None, :])[2][1:]
    if len(free):
        gram = free @ (s.T @ s + noise) @ free.T
        right = free @ (s.T @ t - (s.T @ s + noise) @ base.T)
        base = base + (np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ right).T @ free
    return base / size


def _unpack(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    v = np.asarray(values, float)
    return v[..., 0], v[..., 1], v[..., 2]


def _chromatic(c: np.ndarray) -> np.ndarray:
    """Return c^7 / (c^7 + 25^7)."""
    c3 = c * c * c
    c7 = c3 * c3 * c
    return c7 / (c7 + 25.0**7)


def _hues(
    a1: np.ndarray, b1: np.ndarray, c1: np.ndarray, a2: np.ndarray, b2: np.ndarray, c2: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (dH, cosine of the mean hue, sine of the mean hue) of two colours.

    dH is 2 sqrt(c1 c2) sin(dh / 2), and the mean hue is the middle of the shorter arc. Both are
    computed from vectors, without angles: dH = cross product / (sqrt(c1 c2) cos(dh / 2)), and the
    mean hue is the direction of the sum of both unit vectors. For nearly opposite hues this sum
    cancels, and angles are used. A grey has no hue: the mean hue is that of the other colour, and
    dH is 0.

    Parameters
    ----------
    a1, b1, c1 : a*, b* and chroma of the first colour.
    a2, b2, c2 : a*, b* and chroma of the second colour.
    """
    both = c1 * c2
    along = a1 * a2 + b1 * b2
    grey = both == 0
    half = np.sqrt(np.maximum(both + along, 0.0) / 2)
    dh = (a1 * b2 - b1 * a2) / np.where(half > 0, half, np.inf)
    cos = np.where(grey, a1 + a2, a1 * c2 + a2 * c1)
    sin = np.where(grey, b1 + b2, b1 * c2 + b2 * c1)
    size = np.sqrt(cos * cos + sin * sin)
    none = size == 0
    cos = (cos + none) / (size + none)
    sin = sin / (size + none)
    opposite = (along < -0.99 * both) & ~grey
    if np.any(opposite):
        h1, h2 = (
            np.degrees(np.arctan2(b[opposite], a[opposite])) % 360 for a, b in ((a1, b1), (a2, b2))
        )
        apart = (h2 - h1 + 180) % 360 - 180
        # for exactly opposite hues with h2 > h1 the paper has +180; the remainder above gives -180
        apart = np.where((apart == -180) & (h2 > h1), 180.0, apart)
        mean = np.radians((h1 + h2) / 2 + 180 * (np.abs(h1 - h2) > 180))
        dh[opposite] = 2 * np.sqrt(both[opposite]) * np.sin(np.radians(apart / 2))
        cos[opposite], sin[opposite] = np.cos(mean), np.sin(mean)
    return dh, cos, sin
