"""What lenses and flares of this package offer each other, as Protocols.

`LensOptics` and `PupilOptics` are all that the code of pupils, kernels and imaging knows of a lens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from isethdr_core.physics.optics.pupil import Matrix


class LensOptics(Protocol):
    """A lens that states where it images a field, and what share of the light arrives there."""

    @property
    def focal_length_mm(self) -> float: ...

    @property
    def f_number(self) -> float:
        """Focal length over the diameter of the entrance pupil."""
        ...

    @property
    def magnification(self) -> float:
        """Absolute magnification of an object at the design distance of the lens."""
        ...

    @property
    def distortion(self) -> Any:
        """Model and coefficients, or "none"."""
        ...

    @property
    def lateral_colour_percent(self) -> dict[float, float]:
        """Error of the magnification {wavelength nm: %}."""
        ...

    @property
    def blurs(self) -> bool:
        """Whether the lens spreads the light of a tile over other tiles."""
        ...

    @property
    def field_varies(self) -> bool:
        """Whether the point spread depends on the position in the field."""
        ...

    @property
    def aperture_loss(self) -> bool:
        """Whether the light that flares block is lost."""
        ...

    def throughput_sr(self) -> float:
        """Return irradiance over radiance on the axis, sr."""
        ...

    def gains_sr(self, wavelength_nm: np.ndarray, /) -> np.ndarray:
        """Return irradiance over radiance on the axis for each band, sr.

        Parameters
        ----------
        wavelength_nm : (band,) centres of the bands, nm.
        """
        ...

    def distortion_to(self, angle_rad: float, /) -> Any:
        """Return the distortion of a field that extends to this angle from the axis, rad."""
        ...

    def image_size_m(
        self, width: float, height: float, projection: str = "tangent", /
    ) -> tuple[float, float]:
        """Return (width, height) of the largest centred rectangle within a field's image, m.

        Parameters
        ----------
        width, height : size of the field, in tangents of the field angle or in radians.
        projection : unit of both: `tangent` or `equidistant` (radians).
        """
        ...

    def falloff_to(self, angle_rad: float, /) -> Any:
        """Return the relative illumination of a field that extends to this angle from the axis,
        rad.
        """
        ...

    def chief_rays_to(self, angle_rad: float, /) -> dict[str, list[float]] | None:
        """Return where and at which angles the chief rays of a field meet the sensor.

        The field extends to `angle_rad` from the axis. The result has two lists,
        `radius_per_focal_length` and `angle_deg`, the angle to the sensor's normal. It is None
        where the lens does not know them.
        """
        ...


class PupilOptics(LensOptics, Protocol):
    """A lens with a pupil. Its point spread follows from the pupil's shape, wavefront and
    flares.
    """

    @property
    def zernike_um(self) -> Any:
        """Wavefront error {OSA index: rms um} over the stop; None: no error."""
        ...

    @property
    def focal_shift_um(self) -> dict[float, float]:
        """Distance of the focus behind the sensor {wavelength nm: um}."""
        ...

    @property
    def speckle_error(self) -> float:
        """Largest allowed relative sampling error of a kernel, as a mean over tiles at one radius
        from the axis.
        """
        ...

    @property
    def pupil_matrix(self) -> Matrix | None:
        """Linear map from the stop to the pupil; None: identity."""
        ...

    @property
    def uneven(self) -> tuple[tuple[int, float], ...]:
        """Zernike terms (OSA index, value) of the amplitude over the stop; none: uniform."""
        ...

    @property
    def rims(self) -> tuple[tuple[float, float, float], ...]:
        """Circles (x, y, radius) that cut the stop, in radii of the stop."""
        ...

    @property
    def traced(self) -> Any:
        """Lens from which the change of the wavefront with wavelength is traced; None: no change
        is traced.
        """
        ...


@runtime_checkable
class TracesChiefRays(Protocol):
    """A lens that knows the image size of each wavelength from traced rays."""

    def magnification_at(
        self, tangent: npt.NDArray[np.float64], wavelength_nm: float, /
    ) -> npt.NDArray[np.float64]:
        """Return the image height divided by that at the reference wavelength.

        Parameters
        ----------
        tangent : array of tangents of the field angle.
        wavelength_nm : wavelength, nm.
        """
        ...


@runtime_checkable
class TracesColour(Protocol):
    """A lens that knows the wavefront of each wavelength over the field from traced rays."""

    @property
    def lateral_colour(self) -> str:
        """Where chief rays of other wavelengths land: "none" for the same place, or "traced"."""
        ...

    def colour_at(self, angle_rad: float, wavelength_nm: float, /) -> dict[int, float]:
        """Return the change of the wavefront at a wavelength, {OSA index: um}.

        Parameters
        ----------
        angle_rad : field angle from the axis, along +x of the field, rad.
        wavelength_nm : wavelength, nm.
        """
        ...


@runtime_checkable
class BlursByDepth(Protocol):
    """A lens that may be focused at one distance."""

    @property
    def focus_m(self) -> str | float:
        """Distance in focus, m; "hyperfocal": defocus blur is left out."""
        ...

    def in_focus(self) -> Any:
        """Return the lens that has all depths in focus."""
        ...


class FieldAngles(NamedTuple):
    """The projection of a field, and its largest angle from the axis."""

    projection: str  # `tangent` or `equidistant`
    widest_rad: float


@runtime_checkable
class ChecksLens(Protocol):
    """A flare that not every lens and field can have. It is asked before any work."""

    def check_lens(self, lens: LensOptics, field: FieldAngles, /) -> None:
        """Raise ConfigError if the flare does not fit the lens or the field."""


@runtime_checkable
class DrawsPupil(Protocol):
    """A flare that knows its exact shapes in the pupil, so that they need no sampling."""

    def pupil_shapes(self, radius_mm: float, /) -> tuple[Any, Any]:
        """Return (opening, dirt): a shape, and ((shape, loss of amplitude), ...), in mm.

        Parameters
        ----------
        radius_mm : radius of the round stop, mm.
        """
        ...
