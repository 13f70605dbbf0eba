"""Colour: XYZ to linear and encoded sRGB, CIELAB, colour differences, and the matrix from a sensor to XYZ.

Every function takes the three values on the last axis. XYZ may be of any scale; sRGB expects Y = 1 for white.
"""

from __future__ import annotations

import numpy as np

# IEC 61966-2-1:1999, the four-digit matrix of the standard
XYZ_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
D65_XYZ = np.array([0.95047, 1.0, 1.08883])  # white of sRGB, Y = 1


def linear_srgb(xyz):
    """Return linear sRGB from XYZ with Y = 1 for white; neither clipped nor encoded."""
    return np.asarray(xyz) @ XYZ_TO_SRGB.T


def xyz_from_linear_srgb(rgb):
    """Return XYZ from linear sRGB: the exact inverse of `linear_srgb`."""
    return np.asarray(rgb) @ np.linalg.inv(XYZ_TO_SRGB).T


def srgb_encode(linear):
    """Return sRGB code values 0..1 from linear values, which are first clipped to 0..1 (IEC 61966-2-1:1999)."""
    v = np.clip(linear, 0.0, 1.0)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def srgb_decode(code):
    """Return linear values 0..1 from sRGB code values 0..1."""
    v = np.clip(code, 0.0, 1.0)
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def lab(xyz, white_xyz):
    """Return CIELAB (CIE 015:2018, 8.2.1) of XYZ against a white of the same scale.

    The linear branch also serves negative estimates, so noise around black stays around L* = 0.
    """
    t = np.asarray(xyz, float) / np.asarray(white_xyz, float)
    edge = 6 / 29
    f = np.where(t > edge**3, np.cbrt(np.maximum(t, edge**3)), t / (3 * edge**2) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def de76(lab_1, lab_2):
    """Return the CIE 1976 colour difference, the distance in CIELAB."""
    return np.sqrt(np.sum((np.asarray(lab_1) - np.asarray(lab_2)) ** 2, -1))


def de94(lab_reference, lab_sample):
    """Return the CIE 1994 colour difference for graphic arts; not symmetric, the weights are the reference's (CIE 116:1995)."""
    (l1, a1, b1), (l2, a2, b2) = _unpack(lab_reference), _unpack(lab_sample)
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    dh2 = np.maximum((a1 - a2) ** 2 + (b1 - b2) ** 2 - (c1 - c2) ** 2, 0.0)  # rounding may leave it just below 0
    return np.sqrt((l1 - l2) ** 2 + ((c1 - c2) / (1 + 0.045 * c1)) ** 2 + dh2 / (1 + 0.015 * c1) ** 2)


def de2000(lab_1, lab_2):
    """Return the CIEDE2000 colour difference with kL = kC = kH = 1 (Sharma, Wu, Dalal 2005, equations 2-22)."""
    (l1, a1, b1), (l2, a2, b2) = _unpack(lab_1), _unpack(lab_2)
    c7 = ((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2) ** 7
    stretch = 1 + 0.5 * (1 - np.sqrt(c7 / (c7 + 25.0**7)))
    a1, a2 = a1 * stretch, a2 * stretch
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, a1)) % 360, np.degrees(np.arctan2(b2, a2)) % 360
    grey = c1 * c2 == 0
    dh = np.where(grey, 0.0, (h2 - h1 + 180) % 360 - 180)
    # exactly opposite hues: the paper takes +180 when h2 > h1, the remainder above gives -180
    dh = np.where((dh == -180) & (h2 > h1), 180.0, dh)
    far = np.abs(h1 - h2) > 180
    mean_h = np.where(grey, h1 + h2, np.where(far, np.where(h1 + h2 < 360, h1 + h2 + 360, h1 + h2 - 360), h1 + h2) / 2)
    mean_l, mean_c = (l1 + l2) / 2, (c1 + c2) / 2
    t = (1 - 0.17 * _cos(mean_h - 30) + 0.24 * _cos(2 * mean_h) + 0.32 * _cos(3 * mean_h + 6)
         - 0.20 * _cos(4 * mean_h - 63))
    s_l = 1 + 0.015 * (mean_l - 50) ** 2 / np.sqrt(20 + (mean_l - 50) ** 2)
    s_c, s_h = 1 + 0.045 * mean_c, 1 + 0.015 * mean_c * t
    turn = 2 * np.sqrt(mean_c**7 / (mean_c**7 + 25.0**7)) * -np.sin(np.radians(60 * np.exp(-(((mean_h - 275) / 25) ** 2))))
    dl, dc = (l2 - l1) / s_l, (c2 - c1) / s_c
    dhh = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(dh / 2)) / s_h
    return np.sqrt(dl**2 + dc**2 + dhh**2 + turn * dc * dhh)


def colour_matrix(response, xyz, white_response, white_xyz, noise_covariance=0.0):
    """Return the matrix (3, channel) from a sensor's responses to XYZ that is exact for one white and best for the rest.

    White-preserving least squares (Finlayson, Drew 1997): M minimises sum |M s - t|^2 + trace(M N M^T) over the
    samples under M white_response = white_xyz. One channel leaves no freedom: M = white_xyz / white_response.

    Parameters
    ----------
    response : (sample, channel) array; scale each sample so that it has the weight it deserves.
    xyz : (sample, 3) array, the XYZ of the same samples on the same scale.
    white_response, white_xyz : (channel,) and (3,), the white that comes back exactly.
    noise_covariance : (channel, channel) N, the noise of one response times the number of samples; 0 for none.
    """
    s, t = np.asarray(response, float), np.asarray(xyz, float)
    u, v = np.asarray(white_response, float), np.asarray(white_xyz, float)
    noise = np.broadcast_to(noise_covariance, (len(u), len(u)))
    # channels differ by decades, also in how far noise drowns them: each in units of its own signal and noise
    size = np.sqrt(np.sum(s**2, axis=0) + np.diag(noise))
    size = np.where(size > 0, size, 1.0)
    s, u, noise = s / size, u / size, noise / np.outer(size, size)
    base = np.outer(v, u) / np.sum(u**2)  # one matrix that keeps the white; the rest lives in its null space
    free = np.linalg.svd(u[None, :])[2][1:]
    if len(free):
        gram = free @ (s.T @ s + noise) @ free.T
        right = free @ (s.T @ t - (s.T @ s + noise) @ base.T)
        base = base + (np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ right).T @ free
    return base / size


def _unpack(values):
    v = np.asarray(values, float)
    return v[..., 0], v[..., 1], v[..., 2]


def _cos(degrees):
    return np.cos(np.radians(degrees))
