"""Lens plan: how one lens makes the light of one field; all that could be left out has been decided
upon.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core import ledger, quantities
from isethdr_core.data.temporal_modulation import components, each_component
from isethdr_core.demand import Response
from isethdr_core.errors import PluginError
from isethdr_core.ledger import LeftOut
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.plugins.protocols import AddsLight
from isethdr_core.uncertainty.error_terms import ErrorMaps, ErrorTerm

from ..field import errors, retiling
from ..imaging import irradiance, photocurrent, wing_truncation
from ..imaging.field_optics import FieldOptics
from ..psf.error_parts import KERNELS, SPREAD
from .region import Region, errors_on_window

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class LensPlan:
    """A plan (`isethdr_core.plugins.protocols.ImagingPlan`) of one lens and one field."""

    lens: Any
    flares: tuple  # whose ghosts sensors can tell
    region: Region  # of the field
    optics: FieldOptics  # of that region
    error_allowed: float  # relative, of convolutions band by band
    response: (
        Response | None
    )  # of sensors that get photocurrent where that is better; None: irradiance
    terms: tuple[ErrorTerm, ...]
    left_out: tuple[LeftOut, ...]
    checked: weakref.ref | None = field(default=None, repr=False)  # radiance known to be sound

    def image(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return irradiance or photocurrent of mixed radiance ([component,] wavelength, y, x).

        The output covers the same tiles, in metres, or those that a distortion and the sensors'
        window leave.

        Raises
        ------
        UnitError : `mixed` is no mixed radiance, holds negative or non-finite light, or lies on
            another field.
        """
        if self.checked is None or self.checked() is not mixed:
            for _, one in components(mixed):
                quantities.check_mixed(one)
        return self._image(self.region.of(mixed))

    @each_component
    def _image(self, mixed):
        if self.optics.made is not None:
            ledger.rest_part(SPREAD)  # terms of the plan act on it
        cube = np.asarray(mixed.values)
        found = None
        if self.response is not None:
            found = photocurrent.photocurrent(cube, self.optics, self.response)
        if found is None:
            made = irradiance.irradiance(cube, self.optics, self.error_allowed)
            ledger.record(*made.terms)
            light = self._placed(
                made.values,
                quantities.plane,
                self.optics.wavelength_nm,
                units=quantities.IRRADIANCE,
            )
        else:
            ledger.record(*found.terms)
            light = self._placed(
                found.values,
                quantities.photocurrent,
                found.channels,
                wavelength_nm=self.optics.wavelength_nm,
                efficiency=found.efficiency,
            )
        counting = found and found.efficiency * photons_per_energy(self.optics.wavelength_nm)
        for added in self._added(mixed):
            light.values += added if found is None else np.tensordot(counting, added, 1)
        if found is None:
            quantities.check_irradiance(light)
        return self.region.widened(light, self.response and self.response.efficiency)

    def light_errors(self, mixed, weights) -> ErrorMaps:
        """Return how wrong the kernels make light of `mixed`, (channel, y, x).

        Parameters
        ----------
        weights : (channel, band) what is counted of irradiance, for every band of `mixed`.

        Returns
        -------
        One tile per tile of the light that `image` makes.
        """
        part = self.region.of(mixed)
        found = errors.spread_errors(part, self.optics, weights[:, self.region.kept])
        maps = ErrorMaps(*found, KERNELS, "kernels beyond their exact core")
        return errors_on_window(maps, self.lens, self.optics, self.region.window_m)

    def _placed(self, values, make, first, **attrs):
        """Return make(values, first, x, y, ...) of light (first, y, x), moved to the sensor plane's
        tiles.
        """
        sensor = self.optics.sensor

        def placed(moved):
            return self._on_sensor(make, moved, first, **attrs)

        if sensor.keeps_grid:
            return placed(values)
        moved = sensor.move(values)
        if ledger.records_errors():
            lost = retiling.losses(sensor, values, moved)
            ledger.record(*lost.terms)
            ledger.light_part(retiling.DETAIL, placed(lost.within_tiles), within_tiles=True)
            if lost.of_border is not None:
                ledger.light_part(retiling.BORDER, placed(lost.of_border))
        return placed(moved)

    def _on_sensor(self, make, values, first, **attrs):
        """Return make(values, first, x, y, ...), light on the sensor plane with the attributes of
        the lens.
        """
        lens, given = self.lens, self.optics
        f_m = 1e-3 * lens.focal_length_mm
        throughput_sr = lens.throughput_sr() * float(
            np.mean(given.gains / lens.gains_sr(given.wavelength_nm))
        )  # what flares leave of it, mean of all bands
        light = make(
            values,
            first,
            given.sensor.x * f_m,
            given.sensor.y * f_m,
            f_number=lens.f_number,
            focal_length_mm=lens.focal_length_mm,
            throughput_sr=throughput_sr,
            field_width=given.sensor.field[0] * f_m,
            field_height=given.sensor.field[1] * f_m,
            **given.sensor.attrs,
            **attrs,
        )
        for name, d, p in (
            ("pitch_x", "x", given.pitch_um[1]),
            ("pitch_y", "y", given.pitch_um[0]),
        ):
            if light.sizes[d] == 1:
                light.attrs[name] = p * 1e-6
        return light

    def _added(self, mixed):
        """Yield the irradiance (wavelength, y, x) that each flare adds, and first what stands for a
        tail that was left out.
        """
        given = self.optics
        shape = (len(given.wavelength_nm), len(given.sensor.y), len(given.sensor.x))
        if isinstance(given.made, wing_truncation.NearKernels):
            yield (given.made.added * given.gains)[:, None, None]
        for flare in self.flares:
            if not isinstance(flare, AddsLight):
                continue
            if given.sensor.keeps_grid:
                added = flare.irradiance(self.lens, mixed)
            else:
                covered = given.sensor.covered(mixed)
                added = given.sensor.cut(flare.irradiance(self.lens, covered))
            if (
                tuple(added.dims) != quantities.MIXED_DIMS
                or added.shape != shape
                or added.attrs.get("units") != quantities.IRRADIANCE
            ):
                raise PluginError(
                    f"flare {type(flare).__name__} added light with dims {tuple(added.dims)}, shape"
                    f" {added.shape}, units {added.attrs.get('units')!r}; expected"
                    f" {quantities.MIXED_DIMS}, {shape}, {quantities.IRRADIANCE!r}"
                )
            yield added.values
