"""Field-point lens: a lens with the pupil and wavefront of one field point everywhere."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import cos, sin
from typing import Any

from isethdr_core.physics.optics.pupil import Matrix
from isethdr_core.physics.optics.zernike import rotated

from ..abilities import TracesColour
from .limits import Zernikes
from .thin_lens import DiffractionLimitedLens

ROUNDING = 1e-12  # rounding error, in radii of the stop
# fixed allowed error of the grid of field points; the colour of a lens does not depend on it
ERROR_ALLOWED = 0.05


@dataclass(frozen=True)
class PlaceLens(DiffractionLimitedLens):
    """The pupil and the wavefront, with its change over wavelength, of one field point of another
    lens.
    """

    zernike_um: Zernikes = field(default_factory=dict)  # {OSA index: rms in micrometres}
    traced: Any = None  # lens from which the change of the wavefront with wavelength is traced
    angle_rad: float = 0.0  # field angle of the field point
    azimuth_rad: float = 0.0  # azimuth of the field point, counter-clockwise from +x, y up
    # discs (x, y, radius), in stop radii, y down, that limit the stop
    rims: tuple[tuple[float, float, float], ...] = ()
    # (OSA index, value) of the amplitude over the stop, its mean square 1; none: uniform
    uneven: tuple[tuple[int, float], ...] = ()
    # map from a point of the stop to its direction cosines at the image, both in units of the stop
    # of the f-number; x right, y down. Rims, wavefront and amplitude are defined over the stop.
    # None: identity
    pupil_matrix: Matrix | None = None

    def colour_um(self, wavelength_nm: float) -> dict[int, float]:
        """Return the difference of a wavelength's wavefront from `zernike_um`, {OSA index: um}."""
        if self.traced is None:
            return {}
        if wavelength_nm not in self._colours:
            self._colours[wavelength_nm] = rotated(
                self.traced.colour_at(self.angle_rad, wavelength_nm), self.azimuth_rad
            )
        return self._colours[wavelength_nm]

    def pupil_scale(self, wavelength_nm: float) -> float:
        """Return the size of the exit pupil at a wavelength over that at the reference
        wavelength.
        """
        if self.traced is None:
            return 1.0
        if wavelength_nm not in self._pupil_scales:
            self._pupil_scales[wavelength_nm] = self.traced.pupil_scale_at(
                self.angle_rad, wavelength_nm
            )
        return self._pupil_scales[wavelength_nm]

    def input_files(self) -> tuple[Any, ...]:
        """Return the files that the traced lens names."""
        return self.traced.input_files() if self.traced is not None else ()

    @cached_property
    def _colours(self) -> dict:
        return {}

    @cached_property
    def _pupil_scales(self) -> dict[float, float]:
        return {}


@dataclass(frozen=True)
class FieldLens(DiffractionLimitedLens):
    """A lens that can return a field-point lens for any field angle."""

    def on_axis(self) -> DiffractionLimitedLens:
        """Return the lens that has this lens's point spread of the axis everywhere."""
        return self.at_place(0.0, 0.0) if self.field_varies else self

    def at_place(self, angle_rad: float, azimuth_rad: float) -> PlaceLens:
        """Return the lens for light from one field point.

        Parameters
        ----------
        angle_rad : field angle from the axis, rad.
        azimuth_rad : azimuth, rad, counter-clockwise from +x, y up.
        """
        return node_lens(self, self.wavefront_at(angle_rad), azimuth_rad, angle_rad)


def node_lens(
    lens: DiffractionLimitedLens,
    more_um: dict[int, float],
    azimuth_rad: float,
    angle_rad: float | None = None,
) -> PlaceLens:
    """Return the lens of one field point.

    Parameters
    ----------
    lens : lens of the whole field.
    more_um : {OSA index: um} added to the lens's own wavefront, for a field point on +x.
    azimuth_rad : azimuth of the field point, radians, counter-clockwise from +x, y up.
    angle_rad : field angle, radians. If it is given, the result of a traced lens also has the
        change of the wavefront with wavelength, and the vignetted pupil.
    """
    zernike_um = dict(lens.zernike_um or {})
    for j, value in rotated(more_um, azimuth_rad).items():
        zernike_um[j] = zernike_um.get(j, 0.0) + value
    shared = {f.name: getattr(lens, f.name) for f in fields(DiffractionLimitedLens)}
    one = {
        "zernike_um": zernike_um,
        "distortion": "none",
        "falloff": "none",
        "lateral_colour_percent": {},
    }
    if angle_rad is None or not isinstance(lens, TracesColour):
        return PlaceLens(**shared | one)
    turned = tuple(
        (x * cos(azimuth_rad), -x * sin(azimuth_rad), radius)
        for x, radius in lens.rims_at(angle_rad)
    )
    uneven = tuple(rotated(lens.amplitude_at(angle_rad), azimuth_rad).items())
    return PlaceLens(
        **shared | one,
        traced=_colour_alone(lens),
        angle_rad=float(angle_rad),
        azimuth_rad=float(azimuth_rad),
        rims=turned,
        uneven=uneven,
        pupil_matrix=_turned_ellipse(*lens.exit_pupil_at(angle_rad), azimuth_rad),
    )


def _turned_ellipse(meridional: float, sagittal: float, azimuth_rad: float) -> Matrix:
    """Return the symmetric matrix that stretches by one factor along an azimuth and by another
    across it; x right, y down.

    Parameters
    ----------
    meridional, sagittal : factors along and across the azimuth.
    azimuth_rad : azimuth, rad.
    """
    mean = (meridional + sagittal) / 2
    half = (meridional - sagittal) / 2
    straight = half * cos(2 * azimuth_rad)
    skew = -half * sin(2 * azimuth_rad)
    if abs(skew) < ROUNDING:  # horizontal lines stay horizontal
        skew = 0.0
    return (mean + straight, skew), (skew, mean - straight)


def _colour_alone(lens: DiffractionLimitedLens) -> DiffractionLimitedLens:
    """Return the lens with fixed values of all fields on which its colour does not depend. The name
    of cached kernels then does not depend on them either.
    """
    return replace(
        lens,
        distortion="none",
        falloff="none",
        lateral_colour="none",
        lateral_colour_percent={},
        transmittance=1.0,
        error_allowed=ERROR_ALLOWED,
    )
