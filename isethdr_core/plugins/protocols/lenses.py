"""Lenses: their call, their image, and the memory and time that they take.

The abilities to plan the imaging of a field, and to state errors, are in `lens_plans`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from .lens_plans import (
    MakesPhotocurrent,
    OutlinesImaging,
    PlansImaging,
    StatesErrors,
    StatesSpreadErrors,
)

if TYPE_CHECKING:
    import xarray as xr

    from ...pipeline.memory import Frame
    from .flares import Flare


@runtime_checkable
class Lens(Protocol):
    """Images mixed radiance onto the sensor plane."""

    def __call__(self, mixed: xr.DataArray, /, *, flares: Sequence[Flare] = ()) -> xr.DataArray:
        """Return irradiance on the sensor plane.

        Parameters
        ----------
        mixed : `([component,] wavelength, y, x)` in W m-2 sr-1 nm-1; x and y as the attribute
            `projection` states: tangents of the field angle, or radians.
        flares : flare models in the lens, any number, in any order.

        Returns
        -------
        DataArray `([component,] wavelength, y, x)`, W m-2 nm-1; x and y in metres.
        """


@runtime_checkable
class KnowsImageSize(Protocol):
    """A lens that knows the size of its image."""

    def image_size_m(self, width: float, height: float, projection: str, /) -> tuple[float, float]:
        """Return (width, height) of the largest rectangle in the image of a field, m.

        Parameters
        ----------
        width, height : size of the field, in the unit of the projection: tangents, or radians.
        projection : "tangent" or "equidistant".
        """
        ...


@runtime_checkable
class StatesFieldBorder(Protocol):
    """A lens that loses light at the border of a field."""

    def state_field(self, width: float, height: float, projection: str, /) -> None:
        """State in the ledger how light at the border of the camera's field is treated.

        Parameters
        ----------
        width, height : size of the field, in the unit of the projection: tangents, or radians.
        projection : "tangent" or "equidistant".
        """


@runtime_checkable
class FocusesAtDepth(Protocol):
    """A lens that may blur objects out of focus, by the label `depth` of the radiance."""

    def in_focus(self) -> Lens:
        """Return the lens with all depths in focus; the lens itself if it has no depth blur."""
        ...


@runtime_checkable
class KeepsLight(Protocol):
    """A lens that can keep the light of every tile within the tile.

    It needs no light from beyond the camera's field. A lens that outlines its plan states this
    there (`OutlinesImaging`) instead.
    """

    def keeps_light(self, flares: Sequence[Flare], /) -> bool:
        """Return whether the lens has no blur, no flare and no distortion."""
        ...


@runtime_checkable
class CountsMemory(Protocol):
    """A lens that knows the memory for a frame, and refuses frames that it cannot compute."""

    def held_bytes(self, frame: Frame, flares: Sequence[Flare], /) -> Mapping[str, float]:
        """Return {description: bytes} of all arrays that are held at the same time in addition to
        the light.

        The descriptions are for messages, in the plural: "ray tables".
        """
        ...


@runtime_checkable
class CountsKernels(Protocol):
    """Earlier form of `CountsMemory`, one number; accepted until version 1.0."""

    def kernel_bytes(self, frame: Frame, flares: Sequence[Flare], /) -> float:
        """Return the bytes that the lens holds for a frame in addition to the light."""
        ...


@runtime_checkable
class EstimatesImaging(Protocol):
    """A lens that can estimate the time for the light of a frame."""

    def expected_s(self, frame: Frame, flares: Sequence[Flare], /) -> float | None:
        """Return seconds, given the kept results of earlier runs; None without an estimate.

        `isethdr_core.pipeline.runtime_estimate.machine_speed` tells how fast this processor is.
        """
        ...


@runtime_checkable
class HasPointSpread(Protocol):
    """A lens that shows its point spread function on the axis.

    It is for people and the conformance kit; no stage of a run calls it.
    """

    def psf(self, wavelength_nm: Sequence[float], pitch_um: float, size: int) -> xr.DataArray:
        """Return the share of the light on each sample, (wavelength, y, x), at most 1 in sum.

        Parameters
        ----------
        wavelength_nm : wavelengths, nm.
        pitch_um : distance between samples, um.
        size : samples along each side; the axis is at index size // 2.
        """
        ...


ABILITIES: tuple[type, ...] = (
    KnowsImageSize,
    StatesFieldBorder,
    FocusesAtDepth,
    KeepsLight,
    CountsMemory,
    CountsKernels,
    EstimatesImaging,
    PlansImaging,
    OutlinesImaging,
    MakesPhotocurrent,
    StatesErrors,
    StatesSpreadErrors,
    HasPointSpread,
)
