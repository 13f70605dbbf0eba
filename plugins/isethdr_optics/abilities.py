"""Abilities that lenses and flares of this package offer each other, as Protocols."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


@runtime_checkable
class TracesChiefRays(Protocol):
    """A lens that knows the image size of each wavelength from traced rays."""

    def magnification_at(
        self, tangent: npt.NDArray[np.float64], wavelength_nm: float, /
    ) -> npt.NDArray[np.float64]:
        """Return the image height over that of the reference wavelength.

        Parameters
        ----------
        tangent : of the field angle, an array. `wavelength_nm` : nm.
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
        """Return what a wavelength adds to the wavefront, {OSA index: um}.

        Parameters
        ----------
        angle_rad : off the axis, along +x of the field. `wavelength_nm` : nm.
        """
        ...


@runtime_checkable
class BlursByDepth(Protocol):
    """A lens that may be focused at one distance."""

    @property
    def focus_m(self) -> str | float:
        """The distance in focus, metres; hyperfocal: the blur is left out."""
        ...

    def in_focus(self) -> Any:
        """Return the lens that has all depths in focus."""
        ...


@runtime_checkable
class DrawsPupil(Protocol):
    """A flare that knows the exact shapes in the pupil, which need no sampling."""

    def pupil_shapes(self, radius_mm: float, /) -> tuple[Any, Any]:
        """Return (opening, dirt): a shape, and ((shape, loss of amplitude), ...), in mm.

        Parameters
        ----------
        radius_mm : of the round stop.
        """
        ...
