"""A LOFIC pixel against the figures in the title of its paper: full well, and gain by photon
transfer. The largest SNR is that which follows from the full well. All are measured on shots of the
preset.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..emva1288 import estimates as find
from ..emva1288.camera import Bench, pair
from ..emva1288.study import chosen

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Sensor

PRESET = "lofic_miyauchi2019"
# figures of Miyauchi et al. 2019, at a pitch of 2.8 um
PUBLISHED = {
    "full_well_e": 120000.0,
    "conversion_gain_uv_per_e": 160.0,
}
# levels of the photon transfer, as shares of the scale of a capture
SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
NEAR = 0.98  # level of the largest SNR as a share of the scale, below the clipping of noise
SIZE = 128  # side of the pictures, pixels


def lofic_rows(seed: int) -> Iterator[tuple[Any, ...]]:
    """Yield (figure, published, ours, unit, limit, how) of the pixel of 2.8 um."""
    sensor = replace(chosen(PRESET), cfa="W")
    well = PUBLISHED["full_well_e"]
    microvolts = PUBLISHED["conversion_gain_uv_per_e"]
    light_e = 0.5 * sensor.model().readings[1].swing_e  # both gains read it
    low, high = (measured(sensor, capture, light_e, seed) for capture in (0, 1))
    limit = "2 %: 3 errors of a gain from eight pairs of 128 x 128 pixels"
    yield (
        "LOFIC 2.8 um, full well",
        well,
        low["full_well_e"],
        "e",
        0.02 * well,
        f"LCG at 3 times its light, by photon transfer; {limit}",
    )
    yield (
        "LOFIC 2.8 um, conversion gain",
        microvolts,
        high["uv_per_e"],
        "uV/e",
        0.02 * microvolts,
        f"HCG by photon transfer; {limit}",
    )
    yield (
        "LOFIC 2.8 um, largest SNR",
        10 * np.log10(well),
        low["snr_db"],
        "dB",
        0.3,
        "closed form 10 log10 of the full well; ours at 0.98 of it, with read noise: 0.2 dB less",
    )
    yield (
        "LOFIC 2.8 um, electrons of LCG over HCG",
        1.0,
        low["electrons"] / high["electrons"],
        "1",
        0.02,
        "both gains read one charge",
    )


def measured(sensor: Sensor, capture: int, light_e: float, seed: int) -> dict:
    """Return the figures measured from pictures of one capture: conversion gain, full well, largest
    SNR, and the electrons for `light_e`.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    capture : number of the capture.
    light_e : mean electrons of light at which `electrons` is read back.
    seed : seed of the noise.
    """
    bench = Bench(sensor, capture, 0, 540.0, SIZE, seed)
    reading = sensor.model().readings[capture]
    photons = 1 / bench.efficiency()  # photons per electron
    top = min(reading.swing_e, sensor.full_well_e) * photons
    dark = pair(bench, 0.0)
    near = pair(bench, NEAR * top)
    gain, _ = find.gain_and_responsivity([pair(bench, share * top) for share in SHARES], dark, True)
    codes = 2**sensor.bits - 1 - sensor.black_dn

    def electrons(level: float) -> Any:
        return (pair(bench, level).mean_dn - dark.mean_dn) / gain.value

    return {
        "uv_per_e": 1e6 * sensor.swing_v[capture] / codes * gain.value,
        "full_well_e": electrons(3 * top),
        "snr_db": 20 * np.log10((near.mean_dn - dark.mean_dn) / np.sqrt(near.variance_dn2)),
        "electrons": electrons(light_e * photons),
    }
