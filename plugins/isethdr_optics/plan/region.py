"""Region: the bands and tiles of a field that are imaged, and how the output is completed.

At the ends of the spectrum, bands without light or without response of any sensor are dropped.
Tiles that no sensor sees are dropped if the lens spreads no light.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core import quantities
from isethdr_core.errors import UnitError
from isethdr_core.ledger import LeftOut
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.pipeline import bands
from isethdr_core.pipeline import window as core
from isethdr_core.pipeline.imaging_plan import LightBudget
from isethdr_core.uncertainty.error_terms import ErrorMaps

from ..imaging.field_optics import FieldOptics

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics

UNSEEN = "no sensor responds to them"


@dataclass(frozen=True, eq=False)
class Region:
    """Bands and tiles of one field, and the window of the image plane that sensors see."""

    coordinates: dict[str, np.ndarray]  # wavelength, y and x of the whole field
    kept: np.ndarray  # (band,) mask of the bands that are imaged
    tiles: dict[str, slice] | None = None  # {y, x} slices of the imaged tiles; None: all
    window_m: tuple[float, float] | None = None  # (width, height) of the window; None: all

    def of(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return the imaged part of mixed radiance ([component,] wavelength, y, x).

        Raises
        ------
        UnitError : the field of `mixed` is not the one for which the plan was made.
        """
        for name, planned in self.coordinates.items():
            if name not in mixed.coords or not np.array_equal(mixed[name].values, planned):
                raise UnitError(
                    f"the plan was made for a field with other values of {name!r}; "
                    "make a plan for this field with lens.plan(flares, field, response, budget)"
                )
        if not self.kept.all():
            mixed = mixed.sel(wavelength=self.coordinates["wavelength"][self.kept])
        return mixed if self.tiles is None else core.cut(mixed, self.tiles)

    def widened(self, light: xr.DataArray, efficiency: Callable[..., Any] | None) -> xr.DataArray:
        """Return the light in the window. Dropped bands are added again, without light.

        Parameters
        ----------
        light : irradiance or photocurrent on the sensor plane.
        efficiency : function(wavelength_nm) -> (channel, band) of the sensors; used for
            photocurrent only.
        """
        light = on_window(light, self.window_m)
        if self.kept.all():
            return light
        every_nm = self.coordinates["wavelength"]
        if "wavelength" in light.dims:
            return light.reindex(wavelength=every_nm, fill_value=0.0)
        all_efficiencies = efficiency(np.asarray(every_nm, float))
        kept_efficiencies = all_efficiencies[:, self.kept]
        rows = [
            int(np.abs(kept_efficiencies - own).max(1).argmin())
            for own in light.attrs["efficiency"]
        ]
        return light.assign_attrs(
            wavelength_nm=np.asarray(every_nm, float), efficiency=all_efficiencies[rows]
        )


class RegionOfField(NamedTuple):
    """The part of a field that a lens has to image."""

    region: Region
    mixed: xr.DataArray  # its light
    left_out: list[LeftOut]


def region(
    lens: LensOptics, flares: Sequence[Flare], field: xr.DataArray, budget: LightBudget
) -> RegionOfField:
    """Return the region of a field that a lens has to image.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    field : mixed radiance ([component,] wavelength, y, x).
    budget : window of the sensors and the bands to which they respond.
    """
    full_field = field
    left_out = []
    coordinates = {d: field[d].values for d in ("wavelength", "y", "x")}
    tiles = None
    if budget.window_m is not None and lens.keeps_light(flares):
        width_m, height_m = lens.image_size_m(1.0, 1.0, field.attrs.get("projection", "tangent"))
        inside = core.tiles(field, (budget.window_m[0] / width_m, budget.window_m[1] / height_m))
        part = core.cut(field, inside)
        if part is not field:
            left_out.append(
                tiles_left_out(field.shape, part.shape, UNSEEN, 0.0, quantities.IRRADIANCE)
            )
            tiles = inside
            field = part
    every_nm = field.wavelength.values
    kept = np.ones(len(every_nm), bool)
    if budget.sensed_nm is not None:
        kept, dark = _lit_bands(field, budget.sensed_nm)
        left_out += dark
    chosen = Region(coordinates, kept, tiles)
    return RegionOfField(chosen, chosen.of(full_field), left_out)


def on_window(light: xr.DataArray, window_m: tuple[float, float] | None) -> xr.DataArray:
    """Return the light within a centred window, (width, height) in metres; None: all."""
    return light if window_m is None else light.isel(core.tiles(light, window_m))


def errors_on_window(
    errors: ErrorMaps, lens: LensOptics, optics: FieldOptics, window_m: tuple[float, float] | None
) -> ErrorMaps:
    """Return the part of error maps (channel, y, x) within a window, as `on_window` for light.

    Parameters
    ----------
    errors : errors of the tiles of the sensor plane.
    lens : a lens of this package.
    optics : optics of the field.
    window_m : (width, height) in metres; None: all.
    """
    if window_m is None:
        return errors
    columns, rows = (
        core.within(c * 1e-3 * lens.focal_length_mm, side)
        for c, side in zip((optics.sensor.x, optics.sensor.y), window_m)
    )
    deviation, bound = (e[:, rows, columns] for e in (errors.deviation, errors.bound))
    return errors._replace(deviation=deviation, bound=bound)


def tiles_left_out(
    full_shape: tuple, inner_shape: tuple, why: str, bound: float, unit: str
) -> LeftOut:
    """Return the row of the ledger for tiles that are left out.

    Parameters
    ----------
    full_shape, inner_shape : shapes (..., y, x) of the field, and of its imaged part.
    why : reason, as text for users.
    bound : bound on the effect, in `unit`.
    unit : unit of the bound.
    """
    height, width = full_shape[-2:]
    inner_height, inner_width = inner_shape[-2:]
    out = height * width - inner_height * inner_width
    return LeftOut(
        f"{out} of {height * width} tiles of the field, beyond the middle {inner_width} x"
        f" {inner_height}",
        why,
        float(bound),
        unit,
        key="tiles",
        needless=True,
    )


def _lit_bands(
    mixed: xr.DataArray, offered_nm: tuple[float, ...]
) -> tuple[np.ndarray, list[LeftOut]]:
    """Return the mask (band,) of the bands from the first to the last of `offered_nm` with light,
    and a row of the ledger for the others of `offered_nm`.

    All bands between two lit ones are kept, and neighbours that determine the widths of the outer
    lit bands. The widths of the lit bands are therefore those that they have in the whole field.
    """
    every_nm = mixed.wavelength.values.astype(float)
    waves = tuple(map(float, offered_nm))

    def first(order: Iterable[float]) -> float | None:
        return next((w for w in order if mixed.sel(wavelength=w).values.any()), None)

    ends_nm = first(waves), first(reversed(waves))
    if None in ends_nm:  # no light at all
        return np.isin(every_nm, waves), []
    inside = bands.outer(np.isin(every_nm, ends_nm))
    own_nm = band_widths_nm(every_nm[inside])
    of_field_nm = band_widths_nm(every_nm)[inside]
    changed = ~np.isclose(own_nm[[0, -1]], of_field_nm[[0, -1]])
    kept = np.zeros(len(every_nm), bool)
    kept[max(inside.start - int(changed[0]), 0) : inside.stop + int(changed[-1])] = True
    left_out = int((~kept[np.isin(every_nm, waves)]).sum())
    if not left_out:
        return kept, []
    dark = LeftOut(
        f"{left_out} of {len(waves)} bands",
        "no light in them",
        0.0,
        "W m-2 nm-1",
        key=bands.BANDS,
        needless=True,
    )
    return kept, [dark]
