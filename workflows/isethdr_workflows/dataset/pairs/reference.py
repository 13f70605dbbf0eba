"""The reference on the pixels of a camera: linear XYZ, and the radiance that its filters pass.

Channel radiance is the number of photoelectrons per second, square metre and steradian that the
radiance along a pixel's line of sight makes behind each of the sensor's filters. It is the integral
of radiance x wavelength / (h c) x quantum efficiency. All channels are known at all pixels. Channel
radiance times throughput (sr), photodiode area (m2) and exposure (s) gives the electrons of a sharp
image on the axis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.data.reference_picture import labels_on, mean_over_pixels, truth
from isethdr_core.data.temporal_modulation import time_mean
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.uncertainty.ledger import collected

if TYPE_CHECKING:
    import xarray as xr

CHANNEL_RADIANCE = "photoelectrons s-1 m-2 sr-1"
LABELS = ("instance", "category", "depth", "distance")


def reference(mixed: xr.DataArray, scene: xr.Dataset, captures: xr.Dataset) -> dict[str, Any]:
    """Return the reference data and the labels on a camera's pixels.

    Parameters
    ----------
    mixed : mixed radiance.
    scene : scene radiance with its labels.
    captures : captures of the camera, for its grid and its filters.

    Returns
    -------
    `xyz` (y, x, 3) cd/m2, `channel_radiance` (channel, y, x), the labels that the scene has
    (y, x), `objects` and `lamps` as tables.
    """
    xyz = collected(lambda: truth(mixed, captures)).result
    labels = labels_on(scene, captures)
    arrays: dict[str, Any] = {"xyz": xyz["xyz"].values.astype(np.float32)}
    if "quantum_efficiency" in captures:
        arrays["channel_radiance"] = channel_radiance(mixed, captures)
    for name in LABELS:
        if name in labels:
            arrays[name] = labels[name].values
    return arrays | {"objects": labels.attrs["objects"], "lamps": labels.attrs["lamps"]}


def channel_radiance(mixed: xr.DataArray, captures: xr.Dataset) -> np.ndarray:
    """Return the radiance (channel, y, x) behind each filter, photoelectrons s-1 m-2 sr-1, float32.

    Captures of one shot share their filters, so the first capture's are taken.
    """
    light = time_mean(mixed)
    efficiency = captures["quantum_efficiency"].isel(capture=0)
    kept = light.sel(wavelength=efficiency["wavelength"].values)
    weights = efficiency.values * photons_per_energy(kept["wavelength"].values)
    tiles = np.tensordot(weights, kept.values.astype(float), 1)
    return mean_over_pixels(tiles, light, captures).astype(np.float32)
