"""Field optics: what a lens with flares makes of one field, before any light goes through it.

The sensor plane, the kernels as wide and as exact as they are asked for, and the throughput of
every band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core import quantities
from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Note
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from ..field.imaging import FieldKernels, FieldTiles, field_kernels
from ..psf import band_phase, scatter
from ..psf import kernels as kernel_module
from . import wing_truncation
from .photoelectron_map import Counted
from .sensor_plane import SensorPlane, sensor_plane, without_geometry
from .spread_errors import fine_enough


@dataclass(frozen=True, eq=False)
class FieldOptics:
    """What a lens with flares makes of one field, ready to be applied to its light."""

    sensor: SensorPlane
    made: kernel_module.Kernels | None  # None: no blur
    field: FieldKernels | None  # kernels that vary over the field
    gains: np.ndarray  # irradiance per radiance, sr, per band
    relative: np.ndarray | None  # of the tiles, (y, x)
    wavelength_nm: np.ndarray
    pitch_um: tuple[float, float]
    noise_share: float = 0.0  # of the sensor's noise, what the errors of the kernels take
    counted: Counted | None = (
        None  # what the sensor counts of the field's light, where that had to be known
    )
    notes: tuple[Note, ...] = ()  # of the kernels of the field; the sensor plane has its own


def field_optics(lens, mixed, flares, response=None, sensor: SensorPlane | None = None):
    """Return what a lens with flares makes of the field of checked mixed radiance.

    Parameters
    ----------
    response : `isethdr_core.demand.Response` of the sensors: kernels are then no wider and no more
        exact than these sensors can tell in the light of `mixed`. None: all of the frame, the
        lens's own error.
    sensor : the sensor plane of that field, where it is known.

    Returns
    -------
    `FieldOptics`.
    """
    sensor = sensor or sensor_plane(lens, mixed)
    wavelength_nm = mixed.wavelength.values.astype(float)
    f_m = 1e-3 * lens.focal_length_mm
    pitch_um = tuple(1e6 * f_m * quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    plain, asked = (without_geometry(lens), None if lens.field_varies else response)

    found = []  # of all kernels that are made: the last are those that are used

    def make(reach):
        made, *more = fine_enough(
            lambda one: _kernels(one, flares, wavelength_nm, pitch_um, reach),
            plain,
            mixed,
            sensor.relative,
            asked,
        )
        found.append(more)
        return made

    made = wing_truncation.near_kernels(
        make, plain, flares, mixed, sensor, pitch_um, asked
    ) or make(tuple(mixed.sizes[d] - 1 for d in ("y", "x")))
    field, notes = None, []
    if lens.blurs:
        tiles = FieldTiles(
            *(mixed[d].values.astype(float) for d in ("x", "y")), projection_of(mixed), pitch_um
        )
        field, of_places = field_kernels(lens, tiles, wavelength_nm, flares, made)
        notes = [*band_phase.errors((plain,), wavelength_nm), *of_places]
    loss = (
        made.transmitted if made is not None and lens.aperture_loss else np.ones(len(wavelength_nm))
    )
    relative = sensor.relative if np.ndim(sensor.relative) else None
    return FieldOptics(
        sensor,
        made,
        field,
        lens.gains_sr(wavelength_nm) * loss,
        relative,
        wavelength_nm,
        pitch_um,
        *found[-1],
        tuple(notes),
    )


def _kernels(lens, flares, wavelength_nm, pitch_um, reach):
    """Return kernels, or None where the lens makes no blur and no flare scatters."""
    if lens.blurs:
        return kernel_module.kernels(lens, flares, wavelength_nm, pitch_um, reach)
    for flare in flares:
        if isinstance(flare, TransmitsPupil | DrawsPupil):
            raise ConfigError(
                f"lens 'ideal' has no pupil for the flare {type(flare).__name__}; expected a lens"
                " with diffraction; set lens=diffraction_limited, or remove that flare"
            )
    if not scatter.active(flares, wavelength_nm):
        return None
    bands = []
    for wave in wavelength_nm:
        point = np.zeros([2 * r + 1 for r in reach])
        point[reach] = 1.0
        bands.append(
            scatter.mix(point, flares, wave, pitch_um, lens.focal_length_mm).astype(np.float32)
        )
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    return kernel_module.Kernels(bands, outside, np.zeros(len(bands)), np.ones(len(bands)))
