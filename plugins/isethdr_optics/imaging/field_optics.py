"""Field optics: the data that are computed once for a lens, its flares and a field, before imaging.

They are the sensor plane, the kernels with the required extent and accuracy, and the throughput of
every band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Note
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from ..field.imaging import FieldTiles, field_kernels
from ..field.kernels_of_field import FieldKernels
from ..psf import band_phase, scatter
from ..psf import kernels as kernel_module
from ..psf.kernels import KernelRequest
from . import wing_truncation
from .photoelectron_map import PhotoelectronMap
from .sensor_plane import SensorPlane, sensor_plane, without_geometry
from .spread_errors import fine_enough

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Response
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics
    from ..psf.kernels import Kernels


@dataclass(frozen=True, eq=False)
class FieldOptics:
    """Sensor plane, kernels and throughput of a lens with flares, for one field."""

    sensor: SensorPlane
    kernels: kernel_module.Kernels | None  # None: no blur
    field: FieldKernels | None  # kernels that vary over the field; None: the same everywhere
    gains: np.ndarray  # (band,) irradiance per radiance, sr
    relative: np.ndarray | None  # (y, x) relative illumination of the tiles; None: uniform
    wavelength_nm: np.ndarray
    pitch_um: tuple[float, float]  # (y, x) pitch of the tiles
    noise_share: float = 0.0  # errors of the kernels over the sensor's noise
    # None: the choice of the kernels' accuracy did not need it
    electron_map: PhotoelectronMap | None = None
    notes: tuple[Note, ...] = ()  # notes of the kernels; the sensor plane has its own notes


def field_optics(
    lens: LensOptics,
    mixed: xr.DataArray,
    flares: Sequence[Flare],
    response: Response | None = None,
    sensor: SensorPlane | None = None,
) -> FieldOptics:
    """Return sensor plane, kernels and throughput of a lens with flares for one field.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : checked mixed radiance (wavelength, y, x). It gives the field and its light.
    flares : flare components of the lens.
    response : `isethdr_core.demand.Response` of the sensors. The extent and the accuracy of the
        kernels are then chosen so that these sensors see no difference in the light of `mixed`.
        None: kernels cover the frame, with the error that the lens states.
    sensor : the sensor plane of the field, if it was computed before.

    Returns
    -------
    `FieldOptics`.
    """
    sensor = sensor or sensor_plane(lens, mixed)
    wavelength_nm = mixed.wavelength.values.astype(float)
    f_m = 1e-3 * lens.focal_length_mm
    pitch_um = tuple(1e6 * f_m * quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    axis_lens = without_geometry(lens)
    spatial_response = None if lens.field_varies else response

    details_of_kernels = []  # of all kernels that are computed; the last entry is used

    def make(reach: tuple[int, int]) -> Kernels | None:
        def request(one: LensOptics) -> KernelRequest:
            return KernelRequest(one, flares, wavelength_nm, pitch_um, reach)

        made_kernels, *details = fine_enough(
            lambda one: _kernels(request(one)),
            axis_lens,
            mixed,
            sensor.relative,
            spatial_response,
            lambda factor: kernel_module.can_be_finer(request(axis_lens), factor),
        )
        details_of_kernels.append(details)
        return made_kernels

    kernels_of_axis = wing_truncation.truncated_kernels(
        make,
        axis_lens,
        flares,
        wing_truncation.FieldOnSensor(mixed, sensor, pitch_um),
        spatial_response,
    ) or make(tuple(mixed.sizes[d] - 1 for d in ("y", "x")))
    field = None
    notes = []
    if lens.blurs:
        tiles = FieldTiles(
            *(mixed[d].values.astype(float) for d in ("x", "y")), projection_of(mixed), pitch_um
        )
        field, of_field_points = field_kernels(lens, tiles, wavelength_nm, flares, kernels_of_axis)
        notes = [*band_phase.errors((axis_lens,), wavelength_nm), *of_field_points]
    aperture_share = (
        kernels_of_axis.transmitted
        if kernels_of_axis is not None and lens.aperture_loss
        else np.ones(len(wavelength_nm))
    )
    relative = sensor.relative if np.ndim(sensor.relative) else None
    return FieldOptics(
        sensor,
        kernels_of_axis,
        field,
        lens.gains_sr(wavelength_nm) * aperture_share,
        relative,
        wavelength_nm,
        pitch_um,
        *details_of_kernels[-1],
        tuple(notes),
    )


def _kernels(request: KernelRequest) -> Kernels | None:
    """Return kernels, or None if the lens has no blur and no flare scatters light."""
    lens = request.lens
    flares = request.flares
    if lens.blurs:
        return kernel_module.kernels(request)
    for flare in flares:
        if isinstance(flare, TransmitsPupil | DrawsPupil):
            raise ConfigError(
                f"lens 'ideal' has no pupil for the flare {type(flare).__name__}; expected a lens"
                " with diffraction; type lens=diffraction_limited, or remove that flare"
            )
    if not scatter.active(flares, request.wavelength_nm):
        return None
    bands = []
    for wave in request.wavelength_nm:
        point = np.zeros([2 * r + 1 for r in request.reach])
        point[request.reach] = 1.0
        mixed = scatter.mix(point, flares, wave, request.pitch_um, lens.focal_length_mm)
        bands.append(mixed.astype(np.float32))
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    return kernel_module.Kernels(bands, outside, np.zeros(len(bands)), np.ones(len(bands)))
