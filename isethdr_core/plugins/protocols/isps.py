"""Image signal processing: its call, and what it checks before the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    import xarray as xr

    from ...pipeline.early_checks import ShotForm


@runtime_checkable
class Isp(Protocol):
    """Image signal processing: computes a picture from captures."""

    def __call__(self, captures: xr.Dataset, /) -> xr.Dataset:
        """Return the picture.

        Parameters
        ----------
        captures : captures of one shot, `raw (capture, y, x)` in DN.

        Returns
        -------
        Dataset with `xyz (y, x, xyz_channel)`, Y in cd/m2, `variance` in (cd/m2)^2, and
        `valid (y, x)`.
        """


@runtime_checkable
class ChecksCaptures(Protocol):
    """Image signal processing that depends on the names of captures or on the filter array."""

    def check_shot(self, form: ShotForm, /) -> None:
        """Raise ConfigError where captures of this form cannot be processed."""


ABILITIES: tuple[type, ...] = (ChecksCaptures,)
