"""Lateral colour: an image whose size depends on wavelength, moved band by band on the sensor plane so that light is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.radiometry import band_widths_nm

LARGEST_PERCENT = 5.0  # of magnification: a tile then lands on three at most


def scales(lens, wavelength_nm) -> np.ndarray:
    """Return the magnification of every wavelength over that of the reference: 1 + percent / 100, lines between table entries.

    Raises
    ------
    ConfigError : a wavelength beyond the table.
    """
    table = {float(w): p for w, p in lens.lateral_colour_percent.items()}
    known, wave = sorted(table), np.asarray(wavelength_nm, float)
    if known and not known[0] <= wave.min() <= wave.max() <= known[-1]:
        raise ConfigError(
            f"lens.lateral_colour_percent is known from {known[0]:g} to {known[-1]:g} nm; expected {wave.min():g} to {wave.max():g} nm "
            "within it; add those wavelengths to the table"
        )
    return 1 + np.interp(wave, known, [table[w] for w in known]) / 100 if known else np.ones(len(wave))


def coloured(lens, mixed, plane):
    """Return the sensor plane with the magnification of every band, less the border that the smallest image does not cover.

    States in the ledger what this changes beside the light's place. The same plane where all magnifications are 1.
    """
    wave = mixed.wavelength.values.astype(float)
    scale = scales(lens, wave)
    if (scale == 1).all():
        return plane
    whole = len(plane.y), len(plane.x)
    cut = [int(np.ceil(max(n / 2 * (1 - scale.min()) - 1e-9, 0.0))) for n in whole]
    if any(n <= 2 * c for n, c in zip(whole, cut)):
        raise ConfigError("lens.lateral_colour_percent leaves no whole tile of the field on the sensor; expected a finer or wider field")
    y, x = (a[c : len(a) - c] for a, c in zip((plane.y, plane.x), cut))
    pitch = [quantities.tile_pitch(mixed, d) for d in ("x", "y")]
    field = tuple(min(w, n * p) for w, n, p in zip(plane.field, (len(x), len(y)), pitch))
    ledger.error(np.abs(scale**-2.0 - 1).max(), "relative", "measured",
                 "uniform light of a band, spread over a larger or smaller image, from what the attributes say")
    ledger.error(np.abs(scale - 1).max(), "relative", "measured", "size of the point spread, drawn out as a band's image is")
    radius = np.hypot(*(n / 2 for n in whole))
    smear = radius * np.abs(np.gradient(scale, wave)) * band_widths_nm(wave) if len(wave) > 1 else np.zeros(1)
    ledger.left_out("change of magnification within a band", "each band has one", float(smear.max()), "tiles at the corner")
    return replace(plane, x=x, y=y, field=field, scales=scale, whole=whole)


def magnified(light, scale: float, shape) -> np.ndarray:
    """Return constant tiles (y, x), magnified about the middle by `scale`, on (y, x) tiles of `shape` and the same pitch.

    Every tile's light is spread evenly over its image, and shared by area: sums are kept but for what leaves the border.
    """
    out = np.asarray(light, float)
    for axis, count in enumerate(shape):
        first, weights = _shares(out.shape[axis], count, scale)
        last = out.shape[axis] - 1
        wide = (slice(None), None) if axis == 0 else (None, slice(None))
        out = sum(out.take(np.clip(first + t, 0, last), axis) * w[wide] for t, w in enumerate(weights))
    return out


def _shares(size, count, scale):
    """Return the first tile that each of `count` tiles takes light from, and the shares (tap, tile), 0 beyond the last of `size`."""
    low = np.arange(count) - count / 2
    first = np.floor(low / scale + size / 2).astype(np.intp)
    number = first + np.arange(3)[:, None]
    left = np.maximum((number - size / 2) * scale, low)
    right = np.minimum((number + 1 - size / 2) * scale, low + 1)
    return first, np.where((number >= 0) & (number < size), np.maximum(right - left, 0.0) / scale, 0.0)
