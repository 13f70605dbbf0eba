"""Lightings: their call, and what they need of the light groups."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

if TYPE_CHECKING:
    import xarray as xr


@runtime_checkable
class Lighting(Protocol):
    """Mixes the light groups of a scene."""

    def __call__(self, radiance: xr.Dataset, /) -> xr.DataArray:
        """Return mixed radiance, with the weights used in the attribute `weights` {group: weight}.

        Parameters
        ----------
        radiance : scene radiance, `radiance (light_group, wavelength, y, x)` in W m-2 sr-1 nm-1.

        Returns
        -------
        DataArray `([component,] wavelength, y, x)`, W m-2 sr-1 nm-1.
        """


@runtime_checkable
class LooksWithinField(Protocol):
    """A lighting that states whether tiles beyond the camera's field change its weights."""

    WITHIN_FIELD: ClassVar[bool]  # True: these tiles do not change them


@runtime_checkable
class ChecksGroups(Protocol):
    """A lighting that names light groups."""

    def check_groups(self, groups: Sequence[str], /) -> None:
        """Raise ConfigError where the lighting needs a group that is not among `groups`."""


ABILITIES: tuple[type, ...] = (
    LooksWithinField,
    ChecksGroups,
)
