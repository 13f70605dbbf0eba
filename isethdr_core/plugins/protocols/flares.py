"""Flares: the four ways in which a flare acts on light. A flare has at least one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import xarray as xr

    from .lenses import Lens

    Numbers: TypeAlias = npt.NDArray[np.floating[Any]]


@runtime_checkable
class TransmitsPupil(Protocol):
    """A flare that changes the light in the pupil."""

    def pupil(self, x_mm: Numbers, y_mm: Numbers, wavelength_nm: float, /) -> Numbers:
        """Return the complex transmission of the amplitude; its modulus is at most 1.

        Parameters
        ----------
        x_mm, y_mm : positions in the pupil, mm, 0 on the axis, arrays of one shape.
        wavelength_nm : wavelength of the light, nm.

        Returns
        -------
        Complex numbers of the shape of `x_mm`.
        """


@runtime_checkable
class ScattersLight(Protocol):
    """A flare that scatters light by an angle."""

    def scatter(self, wavelength_nm: float, angle_rad: Numbers, /) -> Numbers:
        """Return the share of the light that is scattered, per steradian.

        Its integral over the hemisphere is at most 1.

        Parameters
        ----------
        wavelength_nm : wavelength of the light, nm.
        angle_rad : angle between the scattered ray and the unscattered ray, rad.

        Returns
        -------
        Numbers of 0 or more, 1/sr, of the shape of `angle_rad`.
        """


@runtime_checkable
class AddsLight(Protocol):
    """A flare that adds light to the image, such as ghosts."""

    def irradiance(self, lens: Lens, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return the irradiance that is added to the image, linear in `mixed`.

        Parameters
        ----------
        lens : lens that images the scene.
        mixed : mixed radiance, as for the call of the lens.

        Returns
        -------
        DataArray `(wavelength, y, x)`, W m-2 nm-1, on the grid of the lens's own irradiance.
        """


@runtime_checkable
class RedirectsLight(Protocol):
    """A flare in front of the lens that redirects light, such as drops on a windscreen."""

    def redirected(self, lens: Lens, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return the mixed radiance that reaches the lens, linear in `mixed`.

        A uniform scene becomes no brighter.

        Parameters
        ----------
        lens : lens that images the scene.
        mixed : mixed radiance `([component,] wavelength, y, x)`.

        Returns
        -------
        Mixed radiance with the dims, coordinates and attributes of `mixed`.
        """


# a flare has at least one of these
ABILITIES: tuple[type, ...] = (TransmitsPupil, ScattersLight, AddsLight, RedirectsLight)
Flare: TypeAlias = TransmitsPupil | ScattersLight | AddsLight | RedirectsLight
