"""The lens `prescription`: distortion, relative illumination, f-number and wavefronts of a traced
lens prescription.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import tan
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from isethdr_core.data.camera_geometry import distortion_map, table_values
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity

from ..imaging.accuracy_shares import PLACES_KNOB, SPECKLE_KNOB
from ..prescription.amplitude import amplitude
from ..prescription.exit_pupil import exit_pupil
from ..prescription.field import check, state
from ..prescription.figures import (
    chief_mm,
    chief_rays,
    distortion,
    pupil_area_mm2,
    seen_sr,
    spot,
)
from ..prescription.prescription import load, own_files
from ..prescription.rims import rims
from ..prescription.wavefront import zernike_um
from ..psf.error_parts import POINT_SPREAD, term
from .field_point_lens import FieldLens
from .limits import ErrorAllowed, Falloff
from .thin_lens import DiffractionLimitedLens

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..prescription.prescription import Prescription
    from ..prescription.wavefront import Wavefront

# Wavefronts are traced at whole steps from the first wavelength. These wavelengths are fixed,
# because a band must not depend on the other bands.
FIRST_NM = 380.0
STEP_NM = 20.0
# rms of the amplitude over the stop up to which it counts as uniform. Such an amplitude changes at
# most twice this share of a point's light (L1, Cauchy-Schwarz inequality).
EVEN = 0.002
# L1 error, share of a point's light, per pupil radius by which the exit pupil deviates from its
# ellipse; 0.2 to 2.7 were measured
BORDER_SHARE = 3.0
# extent of traced chief rays over that of the field, for tiles that lateral colour adds around it
BEYOND = 1.05
# number of field points of distortion and relative illumination, from the axis to the border
FIELD_POINTS = 33


@dataclass(frozen=True)
class PrescribedLens(FieldLens):
    """Lens from a prescription: exact rays give distortion, vignetting, throughput and wavefronts
    over the field.
    """

    # name of a lens prescription, or path of a .yaml file; it is scaled to focal_length_mm and
    # stopped to f_number
    prescription: str = "double_gauss"
    # not used: traced rays give the irradiance on the axis over radiance
    pupil: Literal["tangent", "aplanatic"] = "tangent"
    # relative illumination off the axis: traced, a law, or a table {field angle deg: relative
    # illumination}
    falloff: Literal["traced", "cos4", "none"] | Falloff = "traced"
    # distortion: traced, none, or a model as in the lens `ideal`
    distortion: Literal["traced", "none"] | dict[str, Any] = "traced"
    # lateral chromatic aberration, where lateral_colour_percent is empty
    lateral_colour: Literal["traced", "none"] = "traced"
    # wavefront of the point spread functions; none: diffraction alone, the same over the field
    wavefront: Literal["traced", "none"] = "traced"
    # share of a point's light that interpolation between field points may misplace
    error_allowed: ErrorAllowed = 0.05

    accuracy_knobs = (SPECKLE_KNOB, PLACES_KNOB)  # not a field

    def __post_init__(self) -> None:
        super().__post_init__()
        real = self.real()
        if not _areas(real, (0.0,))[0] > 0:
            raise ConfigError(
                f"prescription {real.name!r} passes no light along its axis at"
                f" f/{self.f_number:g}; expected semi-diameters, conics and aspheres that let a"
                " beam through; correct its file, or choose another lens.prescription"
            )

    def colour_at(self, angle_rad: float, wavelength_nm: float) -> dict[int, float]:
        """Return the difference of the traced wavefront of a wavelength from `wavefront_at`, {OSA
        index: um}. It is empty if the lens has a `focal_shift_um`.

        Between traced wavelengths the interpolation is linear in 1 / wavelength^2, because
        dispersion is nearly linear in it (Cauchy).

        Parameters
        ----------
        angle_rad : field angle, rad, along +x of the field.
        wavelength_nm : wavelength, nm.
        """
        if self.focal_shift_um:
            return {}
        ends = [
            (share, around.terms_um)
            for share, around in self._traced_around(angle_rad, wavelength_nm)
        ]
        middle = _traced_wavefront(self.real(), float(angle_rad)).terms_um
        terms = {j for _, around in ends for j in around} | set(middle)
        return {
            j: sum(share * around.get(j, 0.0) for share, around in ends) - middle.get(j, 0.0)
            for j in sorted(terms)
        }

    def pupil_scale_at(self, angle_rad: float, wavelength_nm: float) -> float:
        """Return the size of the exit pupil at a wavelength over that at the reference wavelength.
        It is 1 if the lens has a `focal_shift_um`.

        The interpolation between traced wavelengths is that of `colour_at`.
        """
        if self.focal_shift_um:
            return 1.0
        return sum(
            share * around.pupil_scale
            for share, around in self._traced_around(angle_rad, wavelength_nm)
        )

    def _traced_around(
        self, angle_rad: float, wavelength_nm: float
    ) -> list[tuple[float, Wavefront]]:
        """Return [(share, wavefront), ...] of the traced wavelengths on either side of a
        wavelength.
        """
        step = (float(wavelength_nm) - FIRST_NM) // STEP_NM
        low, high = (FIRST_NM + STEP_NM * (step + k) for k in (0, 1))
        part = (low**-2 - wavelength_nm**-2) / (low**-2 - high**-2)
        ends = ((1 - part, low), (part, high))
        return [
            (share, _traced_wavefront(self.real(), float(angle_rad), w))
            for share, w in ends
            if share
        ]

    def magnification_at(self, tangent: np.ndarray, wavelength_nm: float) -> np.ndarray:
        """Return the heights on the sensor of traced chief rays of a wavelength over those of the
        reference wavelength. They are 1 if lateral colour is not traced.

        Parameters
        ----------
        tangent : tangents of the field angle, any shape.
        wavelength_nm : wavelength, nm.
        """
        if self.lateral_colour != "traced":
            return np.ones(np.shape(tangent))
        return np.asarray(
            _traced_magnification(
                self.real(), tuple(np.ravel(tangent).tolist()), float(wavelength_nm)
            )
        )

    def rims_at(self, angle_rad: float) -> tuple[tuple[float, float], ...]:
        """Return the discs (x, radius), in stop radii, that limit the stop for light from a field
        angle along +x.
        """
        return rims(self.real(), tan(angle_rad))[0]

    def exit_pupil_at(self, angle_rad: float) -> tuple[float, float]:
        """Return the (meridional, sagittal) radius of the exit pupil in direction cosines, at the
        image of a field angle.

        The unit is 1 / (2 x f-number), the radius that follows from the f-number. The radius of an
        inverted pupil is negative.

        Raises
        ------
        ConfigError : rays of that direction do not fill the stop.
        """
        real = self.real()
        pupil = exit_pupil(real, tan(angle_rad), real.reference_nm)
        return -2 * self.f_number * pupil.meridional, -2 * self.f_number * pupil.sagittal

    def amplitude_at(self, angle_rad: float) -> dict[int, float]:
        """Return the amplitude over the stop, {OSA index: value} with the mean square 1, of light
        from a field angle along +x.

        It is empty if the amplitude is so uniform that the point spread hardly changes (`EVEN`).
        """
        terms, share = _traced_apodization(self.real(), float(angle_rad))
        return dict(terms) if share > EVEN else {}

    def input_files(self) -> tuple[Any, ...]:
        """Return the user's own prescription file, if there is one. Its content is part of a run's
        name.
        """
        return own_files(self.prescription)

    def real(self) -> Prescription:
        """Return the `Prescription`, scaled and stopped down."""
        return _as_used(load(self.prescription), self.focal_length_mm, self.f_number)

    def throughput_sr(self) -> float:
        """Return irradiance / radiance on the axis, sr, at the reference wavelength.

        It is the area of the beam that enters, times the transmittance, over the area on the sensor
        per unit of tangent^2. If `falloff` is cos4 or none, it multiplies the field before the
        distortion moves it, and the distortion applies its own area ratio. The area on the sensor
        is then that without distortion, (focal length x (1 + magnification))^2.
        """
        moved = (
            1.0
            if self.falloff in ("cos4", "none")
            else float(distortion_map(self.distortion_to(0.0)).area_ratio(0.0, 0.0))
        )
        [area] = _areas(self.real(), (0.0,))
        return (
            self.transmittance
            * area
            / (self.focal_length_mm * (1 + self.magnification)) ** 2
            / moved
        )

    def gains_sr(self, wavelength_nm: np.ndarray) -> np.ndarray:
        """Return irradiance / radiance on the axis, sr, of every band (band,). The size of the
        entrance pupil depends on the wavelength.
        """
        real = self.real()
        return (
            self.throughput_sr()
            / _areas(real, (0.0,))[0]
            * np.array([_areas(real, (0.0,), float(w))[0] for w in wavelength_nm])
        )

    @property
    def field_varies(self) -> bool:
        """Whether the point spread differs over the field."""
        return self.wavefront == "traced"

    def wavefront_at(self, angle_rad: float) -> dict[int, float]:
        """Return the traced wavefront {OSA index: um} of light from a field angle along +x of the
        field, at the reference wavelength.

        Raises
        ------
        ConfigError : rays of that direction do not fill the stop.
        """
        return _traced_wavefront(self.real(), float(angle_rad))[0]

    def distortion_to(self, angle_rad: float) -> str | dict:
        """Return the distortion of a field up to `angle_rad`, by default a table of traced chief
        rays.

        Raises
        ------
        ConfigError : chief rays of the field miss a surface.
        """
        if self.distortion != "traced":
            return self.distortion
        return _traced_distortion(self.real(), angle_rad)

    def falloff_to(self, angle_rad: float) -> str | dict[float, float]:
        """Return the relative illumination of a field up to `angle_rad`: cos4, none or {field angle
        deg: relative illumination on the sensor}, by default from traced rays.
        """
        if self.falloff != "traced":
            return self.falloff

        drawn = distortion_map(self.distortion_to(angle_rad))
        for more in (BEYOND, 1.0):
            tangent = more * np.linspace(0, np.tan(angle_rad), FIELD_POINTS)
            try:
                relative = (
                    self.relative_illumination(tangent)
                    * drawn.area_ratio(0.0, 0.0)
                    / drawn.area_ratio(tangent, 0.0)
                )
                break
            except (ValueError, ConfigError):  # the distortion or the lens may end at the border
                if more == 1.0:
                    raise
        return dict(zip(np.degrees(np.arctan(tangent)), relative))

    def chief_rays_to(self, angle_rad: float) -> dict[str, list[float]] | None:
        """Return the traced chief rays on the sensor of a field up to `angle_rad`,
        {radius_per_focal_length, angle_deg}; None if they miss a surface.
        """
        return _traced_chief_rays(self.real(), angle_rad)

    def image_size_m(
        self, width: float, height: float, projection: str = "tangent"
    ) -> tuple[float, float]:
        """Return (width, height) in metres of the image of a field on the sensor plane.

        Parameters
        ----------
        width, height : size of the field, in tangents of the field angle or in radians.
        projection : unit of both: `tangent` or `equidistant` (radians).

        Raises
        ------
        ConfigError : no light reaches the corners of the image.
        """
        check(self, width, height, projection)
        return DiffractionLimitedLens.image_size_m(self, width, height, projection)

    def state_field(self, width: float, height: float, projection: str = "tangent") -> None:
        """State in the ledger the vignetting in the corners of a field wider than the design field.

        Parameters
        ----------
        width, height : size of the field, in the unit of `projection`.
        projection : as in `isethdr_core.physics.optics.projection`.
        """
        state(self, width, height, projection)

    def beam(self, tangent: float) -> float:
        """Return the cross-section, perpendicular to the axis, of the beam that enters from a
        tangent of the field angle, over that on the axis.
        """
        axis, areas = _areas(self.real(), (0.0, abs(float(tangent))))
        return float(areas / axis)

    def relative_illumination(self, tangent: ArrayLike) -> np.ndarray:
        """Return the irradiance of a uniform scene at tangents of the field angle, relative to that
        on the axis, as it would be without distortion.
        """
        tangent = np.abs(np.atleast_1d(np.asarray(tangent, float)))
        area = _areas(self.real(), (0.0, *tangent))
        return (1 + tangent**2) ** -2 * area[1:] / area[0]

    def limits(self, widest_rad: float, wavelength_nm: np.ndarray) -> list[Note]:
        """Return the effects of the prescription that this lens neglects, and the errors of its
        model, for one field.

        Parameters
        ----------
        widest_rad : largest field angle, rad.
        wavelength_nm : (band,) centres of the bands, nm.
        """
        real = self.real()
        widest = widest_rad
        edge = min(float(np.tan(widest)), float(np.tan(np.radians(real.half_field_deg))))
        notes: list[Note] = []
        if "traced" == self.distortion == self.falloff:
            label = (
                "uniform light by rays counted from places of the sensor, first and last band, from"
                " what the attributes say"
            )
            counted = term(
                self._uneven(widest, wavelength_nm),
                "of that on the axis",
                "measured",
                label,
                key="traced illumination",
                acts_on=Quantity.ATTRIBUTES,
            )
            notes.append(counted)
        if self.distortion == "none" and edge > 0:
            bent = abs(float(distortion(real, edge)[0]))
            what = "distortion of the prescription"
            notes.append(LeftOut(what, "lens.distortion=none ignores it", bent, "of the position"))
        if not self.field_varies:
            widest_mm = max(spot(real, t).radius_mm for t in (0.0, 0.7 * edge, edge))
            aberrations = LeftOut(
                "geometric aberrations of the prescription",
                "the PSF contains diffraction only",
                widest_mm * 1e-3,
                "m (rms radius)",
            )
            return [*notes, aberrations]
        return [*notes, *self._limits_of_places(widest, wavelength_nm)]

    def _limits_of_places(self, widest: float, wavelength_nm: np.ndarray) -> list[Note]:
        """Return the errors of the models of pupil and wavefront at field points."""
        real = self.real()
        fitted = [_traced_wavefront(real, a)[1] for a in (0.0, widest)]

        def shape_error(value: float, unit: str, label: str, key: str) -> ErrorTerm:
            return term(
                value, unit, "measured", label, key=key, acts_on=Quantity.OTHER, part=POINT_SPREAD
            )

        notes: list[Note] = [
            shape_error(
                max(fitted), "um rms", "wavefront that its Zernike terms leave", "Zernike fit"
            )
        ]
        if not self.focal_shift_um:  # the table replaces the traced change with wavelength
            between = max(_between_um(self, a, float(wavelength_nm[0])) for a in (0.0, widest))
            label = "wavefront between traced wavelengths"
            notes.append(shape_error(between, "um rms", label, "traced wavelengths"))
        even = [
            u
            for u in (_traced_apodization(real, a)[1] for a in np.linspace(0.0, widest, 5))
            if u <= EVEN
        ]
        if even:
            share = 2 * float(max(even))
            notes.append(
                LeftOut("pupil apodization", "it is nearly none", share, "share of a point's light")
            )
        border = max(
            exit_pupil(real, float(np.tan(a)), real.reference_nm).off_ellipse
            for a in np.linspace(0.0, widest, 5)
        )
        label = "exit pupil off the axis, drawn as an ellipse: share of a point's light, L1"
        notes.append(term(BORDER_SHARE * border, "relative", "measured", label, key="exit pupil"))
        label = "rims that cut the stop off the axis, drawn as arcs of circles"
        off_arcs = rims(real, float(np.tan(widest)))[1]
        return [*notes, shape_error(off_arcs, "radii of the stop", label, "rims")]

    def _uneven(self, widest_rad: float, waves: np.ndarray) -> float:
        """Return the largest difference of the light of a uniform scene from throughput x relative
        illumination, over the light on the axis.
        """
        real = self.real()
        falloff = self.falloff_to(widest_rad)
        tangents = np.tan(widest_rad) * np.array([0.0, 0.5, 0.9])
        table = {"angle_deg": list(falloff), "relative": list(falloff.values())}
        stated = table_values(table, np.degrees(np.arctan(tangents))) * self.throughput_sr()
        rays = chief_rays(real, tangents)
        notes_of_angles = [
            [seen_sr(real, height, w, slope=slope) for w in (waves[0], waves[-1])]
            for height, slope in zip(rays.height_mm, np.tan(np.radians(rays.angle_deg)))
        ]
        notes_of_angles = (
            np.array(notes_of_angles) * self.transmittance / (1 + self.magnification) ** 2
        )
        return float(np.abs(notes_of_angles - stated[:, None]).max() / stated[0])


def _between_um(lens: PrescribedLens, angle_rad: float, wavelength_nm: float) -> float:
    """Return the error of the wavefront half way between the two traced wavelengths around
    `wavelength_nm`, um rms without tilt.
    """
    middle = FIRST_NM + STEP_NM * ((wavelength_nm - FIRST_NM) // STEP_NM + 0.5)
    real = lens.real()
    own = lens.colour_at(angle_rad, middle)
    exact = _traced_wavefront(real, angle_rad, middle)[0]
    interpolated = _traced_wavefront(real, angle_rad)[0]
    return (
        sum(
            (own.get(j, 0.0) + interpolated.get(j, 0.0) - exact.get(j, 0.0)) ** 2
            for j in {*own, *exact, *interpolated} - {1, 2}
        )
        ** 0.5
    )


@lru_cache(maxsize=16)
def _as_used(prescription: Prescription, focal_length_mm: float, f_number: float) -> Prescription:
    return prescription.scaled(focal_length_mm).stopped(f_number)


@lru_cache(maxsize=16)
def _traced_distortion(real: Prescription, angle_rad: float) -> dict[str, list[float] | str]:
    for more in (BEYOND, 1.0):
        tangent = more * np.linspace(0, np.tan(max(angle_rad, 1e-3)), FIELD_POINTS)[1:]
        try:
            height = chief_mm(real, tangent, real.reference_nm)
            break
        except ConfigError:
            if more == 1.0:
                raise
    # in focal lengths: a sensor that is not in the paraxial focus has a different scale
    radius = height / real.focal_length_mm()
    return {
        "model": "table",
        "angle_deg": np.degrees(np.arctan(tangent)).tolist(),
        "radius_per_focal_length": radius.tolist(),
    }


@lru_cache(maxsize=16)
def _traced_chief_rays(real: Prescription, angle_rad: float) -> dict[str, list[float]] | None:
    for more in (BEYOND, 1.0):
        tangent = more * np.linspace(0, np.tan(max(angle_rad, 1e-3)), FIELD_POINTS)
        with suppress(ConfigError):
            rays = chief_rays(real, tangent)
            return {
                "radius_per_focal_length": (rays.height_mm / real.focal_length_mm()).tolist(),
                "angle_deg": rays.angle_deg.tolist(),
            }
    return None


@lru_cache(maxsize=256)
def _traced_magnification(
    real: Prescription, tangents: tuple[float, ...], wavelength_nm: float
) -> tuple[float, ...]:
    near_axis = 1e-3 * max(max(tangents), 1e-3)  # on the axis both heights are 0
    field = np.maximum(tangents, near_axis)
    return tuple(chief_mm(real, field, wavelength_nm) / chief_mm(real, field, real.reference_nm))


def _traced_wavefront(
    real: Prescription, angle_rad: float, wavelength_nm: float | None = None
) -> Wavefront:
    return zernike_um(real, tan(angle_rad), wavelength_nm or real.reference_nm)


def _traced_apodization(
    real: Prescription, angle_rad: float
) -> tuple[tuple[tuple[Any, ...], ...], float]:
    return amplitude(real, tan(angle_rad), real.reference_nm)


@lru_cache(maxsize=256)
def _areas(
    real: Prescription, tangents: Sequence[float], wavelength_nm: float | None = None
) -> np.ndarray:
    return pupil_area_mm2(real, tangents, wavelength_nm)
