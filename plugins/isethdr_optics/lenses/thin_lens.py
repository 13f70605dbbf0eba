"""Thin, shift-invariant lenses with a round stop of diameter focal length / f-number.

`lens(mixed, flares)` gives irradiance, `lens.psf(...)` the point spread function, and
`lens.throughput_sr()` irradiance per radiance.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from isethdr_core.data.camera_geometry import distortion_map
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Note
from isethdr_core.physics.radiometry import irradiance_factor, irradiance_factor_aplanatic
from isethdr_core.pipeline.imaging_plan import LightBudget, imaged
from isethdr_core.plugins.ranges import Wavelength, check_ranges

from ..imaging.accuracy_shares import ERROR_SHARES, SPECKLE_KNOB
from ..imaging.array_backend import device_transfer
from ..imaging.sensor_plane import image_size
from ..plan.outline import outline as outlined
from .limits import (
    ErrorAllowed,
    Falloff,
    FNumber,
    FocalLength,
    FocalShift,
    FocusDistance,
    LateralColour,
    ObjectDistance,
    Transmittance,
)

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from isethdr_core.pipeline.demand import Response
    from isethdr_core.pipeline.imaging_plan import FieldAhead, ImagingOutline
    from isethdr_core.pipeline.memory import Frame
    from isethdr_core.plugins.protocols import Flare
    from isethdr_core.uncertainty.error_terms import ErrorMaps

    from ..plan.depth_layers import DefocusedPlan
    from ..plan.lens_plan import LensPlan


WIDEST_CHIEF_RAY_DEG = 80.0
# number of chief rays of the table; cubic interpolation between them has an error of 1e-3 degrees
# up to 60 degrees, and of 0.03 degrees beyond
CHIEF_RAYS = 33


@dataclass(frozen=True)
class IdealLens:
    """Lens without diffraction and aberrations: irradiance is a constant times radiance, with a
    relative illumination. `focus_m` in metres adds the blur of objects out of focus.
    """

    THREAD_SAFE: ClassVar[bool] = True

    f_number: FNumber = 4.0  # focal length / diameter of the entrance pupil
    # focal length; without distortion, position on the sensor = focal length x tangent of the field
    # angle, or x the field angle in radians if the scene is equidistant
    focal_length_mm: FocalLength = 4.0
    transmittance: Transmittance = 1.0  # transmittance of the glass at all wavelengths
    # irradiance on the axis over radiance: tangent pi / (1 + 4 N^2), aplanatic (sine condition) pi
    # / (4 N^2)
    pupil: Literal["tangent", "aplanatic"] = "tangent"
    # relative illumination off the axis: a law, or a table {field angle deg: relative illumination}
    falloff: Literal["cos4", "none"] | Falloff = "cos4"
    # distance of the object for which the working f-number is computed; a near object raises it
    object_distance_m: ObjectDistance = inf
    # distortion: {model: brown_conrady | kannala_brandt | table, and its coefficients}; empty is
    # none
    distortion: Literal["none"] | dict[str, Any] = "none"
    # lateral chromatic aberration {wavelength nm: magnification error}; linear interpolation
    lateral_colour_percent: dict[Wavelength, LateralColour] = field(default_factory=dict)

    # distance in focus: with metres, every tile is blurred by its depth; hyperfocal leaves this out
    focus_m: Literal["hyperfocal"] | FocusDistance = "hyperfocal"

    # these are not fields
    blurs = False  # no light leaves its tile
    field_varies = False  # the point spread is the same in the whole field
    aperture_loss = False  # no flare blocks light
    lateral_colour = "none"  # no chief rays are traced

    def __post_init__(self) -> None:
        _check(self)

    def __call__(
        self, mixed: xr.DataArray, flares: Sequence[Flare] = (), error_allowed: float = 0.0
    ) -> xr.DataArray:
        """Return irradiance of mixed radiance.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : sequence or dictionary of flares in the lens.
        error_allowed : largest relative error of the convolutions; 0: exact computation.
        """
        return imaged(self.plan(flares, mixed, None, LightBudget(error_allowed)), mixed)

    def photocurrent(
        self, mixed: xr.DataArray, flares: Sequence[Flare], response: Response
    ) -> xr.DataArray:
        """Return photocurrent of mixed radiance in the window of a sensor's response, or irradiance
        if that is faster or more accurate for this light.

        Parameters
        ----------
        mixed : mixed radiance ([component,] wavelength, y, x).
        flares : sequence or dictionary of flares.
        response : `isethdr_core.demand.Response` of the sensors.
        """
        budget = LightBudget(response.error_allowed, response.window_m)
        return imaged(self.plan(flares, mixed, response, budget), mixed)

    def plan(
        self,
        flares: Sequence[Flare],
        field: xr.DataArray,
        response: Response | None = None,
        budget: LightBudget | None = None,
    ) -> DefocusedPlan | LensPlan:
        """Return the plan of imaging a field: the tiles, bands, kernels, wings and ghosts that are
        needed.

        Parameters
        ----------
        flares : sequence or dictionary of flares.
        field : mixed radiance (wavelength, y, x), or (component, wavelength, y, x).
        response : `isethdr_core.demand.Response` of the sensors; None asks for irradiance, band by
            band.
        budget : `isethdr_core.pipeline.imaging_plan.LightBudget`; None asks for the exact light
            of all tiles and bands.

        Raises
        ------
        UnitError : `field` is no mixed radiance, or holds negative or non-finite light.
        """
        # imported here: it loads all code of kernels, which composing a configuration does not need
        from ..plan.planning import plan

        return plan(self, _sequence(flares), field, response, budget or LightBudget())

    def outline(
        self, flares: Sequence[Flare], ahead: FieldAhead, budget: LightBudget
    ) -> ImagingOutline:
        """Return what the plan will need and certainly leave out, before the light is known.

        Parameters
        ----------
        flares : sequence or dictionary of flares.
        ahead : `isethdr_core.pipeline.imaging_plan.FieldAhead`, the known facts of the field.
        budget : `isethdr_core.pipeline.imaging_plan.LightBudget`.
        """
        return outlined(self, _sequence(flares), ahead, budget)

    def limits(self, widest_rad: float, wavelength_nm: np.ndarray) -> list[Note]:
        """Return the effects of the lens's design that its model leaves out, and its errors; here
        none.

        Parameters
        ----------
        widest_rad : largest field angle, rad.
        wavelength_nm : (band,) centres of the bands, nm.
        """
        return []

    @property
    def magnification(self) -> float:
        """Absolute magnification of an object at `object_distance_m`: f / (d - f)."""
        f_m = 1e-3 * self.focal_length_mm
        return f_m / (self.object_distance_m - f_m)

    def throughput_sr(self) -> float:
        """Return irradiance / radiance on the axis, sr, for a uniform scene and a clean round
        stop.
        """
        rule = irradiance_factor if self.pupil == "tangent" else irradiance_factor_aplanatic
        return self.transmittance * rule(self.f_number, self.magnification)

    def gains_sr(self, wavelength_nm: np.ndarray) -> np.ndarray:
        """Return irradiance / radiance on the axis, sr, of every band (band,), for a clean round
        stop.
        """
        return np.full(len(wavelength_nm), self.throughput_sr())

    def distortion_to(self, angle_rad: float) -> str | dict:
        """Return the distortion of a field up to `angle_rad`, in the form of the argument of
        `isethdr_core.data.camera_geometry.distortion_map`.
        """
        return self.distortion

    def falloff_to(self, angle_rad: float) -> str | dict[float, float]:
        """Return cos4, none or {field angle deg: relative illumination on the sensor} of a field up
        to `angle_rad`.
        """
        return self.falloff

    def chief_rays_to(self, angle_rad: float) -> dict[str, list[float]] | None:
        """Return the chief rays on the sensor, {radius_per_focal_length, angle_deg}, for a pupil at
        the lens, one focal length in front of the sensor.

        Parameters
        ----------
        angle_rad : field angle, rad; it is not used: the table always reaches 80 degrees.
        """
        angle_deg = np.linspace(0.0, WIDEST_CHIEF_RAY_DEG, CHIEF_RAYS)
        return {
            "radius_per_focal_length": np.tan(np.radians(angle_deg)).tolist(),
            "angle_deg": angle_deg.tolist(),
        }

    def on_axis(self) -> IdealLens:
        """Return the lens that has this lens's point spread of the axis everywhere."""
        return self

    def image_size_m(
        self, width: float, height: float, projection: str = "tangent"
    ) -> tuple[float, float]:
        """Return (width, height) in metres of the largest centred rectangle of the sensor plane
        within the image of a field.

        Parameters
        ----------
        width, height : size of the field, in tangents of the field angle or in radians.
        projection : unit of both: `tangent` or `equidistant` (radians).
        """
        return tuple(
            1e-3 * self.focal_length_mm * side
            for side in image_size(self, width, height, projection)
        )

    def held_bytes(self, frame: Frame, flares: Sequence[Flare]) -> dict[str, float]:
        """Return {name: bytes} of the kernels of an `isethdr_core.pipeline.memory.Frame`.

        The patterns from which they are computed are included. A lens without blur needs 0 bytes.

        Raises
        ------
        ConfigError : the wavefront is too steep for the largest number of pupil cells.
        """
        from ..imaging.kernel_memory import kernel_bytes

        return {"point spread kernels": kernel_bytes(self, _sequence(flares), frame)}

    def expected_s(self, frame: Frame, flares: Sequence[Flare]) -> float | None:
        """Return the expected seconds for the light of an `isethdr_core.pipeline.memory.Frame`,
        given the kernels that are already stored; None for a lens without blur.
        """
        from ..plan.imaging_seconds import expected_s

        return expected_s(self, _sequence(flares), frame)

    def light_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: np.ndarray,
        response: Response | None = None,
    ) -> ErrorMaps:
        """Return the errors of the light of `mixed` due to the kernels' errors.

        Parameters
        ----------
        mixed : mixed radiance (wavelength, y, x).
        flares : sequence or dictionary of flares.
        weights : (channel, band) factors on irradiance.
        response : `isethdr_core.demand.Response` with which the light was computed.

        Returns
        -------
        `isethdr_core.uncertainty.error_terms.ErrorMaps` (channel, y, x), one value per tile of the
        light.
        """
        plan = self.plan(flares, mixed, response)
        return plan.light_errors(mixed, weights)

    def spread_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: np.ndarray,
        response: Response | None = None,
    ) -> ErrorMaps:
        """Return `light_errors` under its earlier name, with a warning; accepted until version 1.0.

        Parameters
        ----------
        mixed, flares, weights, response : as in `light_errors`.
        """
        message = "spread_errors of a lens is now called light_errors"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return self.light_errors(mixed, flares, weights, response)

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand, with the depth of every tile added if the blur depends on it."""
        return demand if self.focus_m == "hyperfocal" else demand.with_labels("depth")

    def in_focus(self) -> IdealLens:
        """Return the lens that has all depths in focus."""
        return self if self.focus_m == "hyperfocal" else replace(self, focus_m="hyperfocal")

    def keeps_light(self, flares: Sequence[Flare]) -> bool:
        """Return whether the light of every tile stays in the tile: no blur, no flare, no
        distortion, no lateral colour.
        """
        return self.focus_m == "hyperfocal" and not (
            flares or self.blurs or self.distortion != "none" or self.lateral_colour_percent
        )

    def psf(
        self,
        wavelength_nm: ArrayLike,
        pitch_um: float = 1.0,
        size: int = 256,
        flares: Sequence[Flare] = (),
    ) -> xr.DataArray:
        """Return the point spread function (wavelength, y, x): all light on the sample at index
        size // 2, except that which flares scatter.

        Parameters
        ----------
        wavelength_nm : one or more wavelengths, nm.
        pitch_um : distance of the samples, um.
        size : number of samples along each axis.
        flares : sequence or dictionary of flares. Only their scatter has an effect, because a lens
            without blur has no pupil.
        """
        from ..psf import scatter
        from ..psf.point_spread import psf_array

        values = np.zeros((np.size(wavelength_nm), size, size))
        values[:, size // 2, size // 2] = 1.0
        for band, wave in enumerate(np.atleast_1d(np.asarray(wavelength_nm, float))):
            values[band] = scatter.mix(
                values[band], _sequence(flares), wave, (pitch_um, pitch_um), self.focal_length_mm
            )
        return psf_array(values, wavelength_nm, pitch_um, self)


@dataclass(frozen=True)
class DiffractionLimitedLens(IdealLens):
    """Blur by diffraction alone, at a round stop or at the aperture that a flare defines."""

    # true removes the light that the flares' apertures block; false is ISETCam's rule
    aperture_loss: bool = True
    # longitudinal chromatic aberration {wavelength nm: distance of the focus behind the sensor};
    # linear interpolation
    focal_shift_um: dict[Wavelength, FocalShift] = field(default_factory=dict)
    # allowed sampling error of a kernel, relative to its light, in each ring of tiles: 1 to 2, 2 to
    # 4, 4 to 8, ... tiles from its centre
    speckle_error: ErrorAllowed = 0.03

    # these are not fields; `field_point_lens.PlaceLens` explains the last five
    accuracy_knobs = (SPECKLE_KNOB,)
    error_shares = ERROR_SHARES
    blurs = True  # by diffraction alone
    zernike_um = None  # no wavefront error
    traced = None  # no traced colour
    rims = ()  # no rims limit the stop
    uneven = ()  # uniform amplitude over the stop
    pupil_matrix = None  # the exit pupil is the round stop of the f-number

    def colour_um(self, wavelength_nm: float) -> dict[int, float]:
        """Return the difference of a wavelength's wavefront from `zernike_um`, {OSA index: um};
        here empty.

        The defocus by `focal_shift_um` is not part of it.
        """
        return {}

    def pupil_scale(self, wavelength_nm: float) -> float:
        """Return the size of the exit pupil at a wavelength over that of the pupil in which shapes
        are defined; here 1.
        """
        return 1.0

    def psf(
        self,
        wavelength_nm: float | list[int],
        pitch_um: float = 1.0,
        size: int = 256,
        flares: Sequence[Flare] = (),
        integrated: bool | None = None,
    ) -> xr.DataArray:
        """Return the point spread function of the lens with `flares`, on the axis.

        Parameters
        ----------
        wavelength_nm : one or more wavelengths, nm.
        pitch_um : distance of the samples, um.
        size : number of samples along each axis; the optical axis is at index size // 2.
        flares : sequence or dictionary of flares.
        integrated : False: intensity at each sample's centre times its area. True: integral over
            each sample's square. None: False if the pitch is below wavelength x working f-number
            for all wavelengths (then the samples sum to the energy), else True.

        Returns
        -------
        DataArray (wavelength, y, x), y and x in metres: the fraction of the light through the pupil
        on each sample. The rest to a sum of 1 falls outside the samples.
        """
        from ..psf.point_spread import point_spread

        return point_spread(
            self.on_axis(), wavelength_nm, pitch_um, size, _sequence(flares), integrated
        )


def _sequence(flares: Sequence[Flare]) -> tuple:
    return tuple(flares.values()) if isinstance(flares, Mapping) else tuple(flares)


def _check(lens: IdealLens) -> None:
    check_ranges(lens)
    if os.environ.get("ISETHDR_ARRAYS"):
        device_transfer()  # raises an error if the device is missing
    if not lens.object_distance_m > 2e-3 * lens.focal_length_mm:
        raise ConfigError(
            f"lens.object_distance_m is {lens.object_distance_m!r}; expected metres, more than"
            " twice the focal length; type lens.object_distance_m=inf for a far object"
        )
    _check_focus(lens.focus_m, lens.focal_length_mm)
    _check_geometry(lens)


def _check_focus(focus_m: str | float, focal_length_mm: float) -> None:
    """Raise ConfigError unless the distance in focus is larger than twice the focal length."""
    if focus_m == "hyperfocal":
        return
    if not focus_m > 2e-3 * focal_length_mm:
        raise ConfigError(
            f"lens.focus_m is {focus_m!r}; expected hyperfocal, or metres, more than twice the"
            " focal length; type for example lens.focus_m=20"
        )


def _check_geometry(lens: IdealLens) -> None:
    if isinstance(lens.distortion, dict):
        distortion_map(lens.distortion)
    if isinstance(lens.falloff, str):
        return
    angles = list(lens.falloff)
    rising = all(a < b for a, b in zip(angles, angles[1:]))
    if len(angles) < 2 or angles[0] != 0 or not rising:
        raise ConfigError(
            f"lens.falloff is {lens.falloff!r}; expected field angles in degrees that rise from 0,"
            " each with a relative illumination of 0 or more; type for example"
            " 'lens.falloff={0:1,20:0.8}'"
        )
