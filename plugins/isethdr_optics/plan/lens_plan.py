"""Lens plan: imaging of one field by one lens, after all decisions about what to leave out."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
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
from ..flare.windscreen import WindscreenFlare
from ..imaging import irradiance, photocurrent, wing_truncation
from ..imaging.field_optics import FieldOptics
from ..psf.error_parts import KERNELS, SPREAD
from .region import Region, errors_on_window

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class LensPlan:
    """A plan (`isethdr_core.plugins.protocols.ImagingPlan`) of one lens and one field."""

    lens: Any
    flares: tuple  # flares, without ghosts that are too faint for the sensors
    region: Region  # imaged part of the field
    optics: FieldOptics  # optics of that part
    error_allowed: float  # largest relative error of convolutions band by band
    response: Response | None  # response of sensors that accept photocurrent; None: irradiance
    terms: tuple[ErrorTerm, ...]
    left_out: tuple[LeftOut, ...]
    checked: weakref.ref | None = field(default=None, repr=False)  # radiance already checked

    def image(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return irradiance or photocurrent of mixed radiance ([component,] wavelength, y, x).

        The output covers the same tiles, in metres; with a distortion or a window of the sensors it
        may cover fewer.

        Raises
        ------
        UnitError : `mixed` is not mixed radiance, holds negative or non-finite light, or has
            another field than the plan.
        """
        if self.checked is None or self.checked() is not mixed:
            for _, component in components(mixed):
                quantities.check_mixed(component)
        return self._image(self.region.of(mixed))

    @each_component
    def _image(self, mixed: xr.DataArray) -> xr.DataArray:
        if self.optics.kernels is not None:
            ledger.rest_part(SPREAD)  # error terms of the plan act on this part
        cube = np.asarray(mixed.values)
        current = None
        if self.response is not None:
            current = photocurrent.photocurrent(cube, self.optics, self.response)
        if current is None:
            light_of_tiles = irradiance.irradiance(cube, self.optics, self.error_allowed)
            ledger.record(*light_of_tiles.terms)
            light = self._placed(
                light_of_tiles.values,
                quantities.plane,
                self.optics.wavelength_nm,
                units=quantities.IRRADIANCE,
            )
        else:
            ledger.record(*current.terms)
            light = self._placed(
                current.values,
                quantities.photocurrent,
                current.channels,
                wavelength_nm=self.optics.wavelength_nm,
                efficiency=current.efficiency,
            )
        electrons_per_joule = current and current.efficiency * photons_per_energy(
            self.optics.wavelength_nm
        )
        for added in self._added(mixed):
            light.values += (
                added if current is None else np.tensordot(electrons_per_joule, added, 1)
            )
        if current is None:
            quantities.check_irradiance(light)
        return self.region.widened(light, self.response and self.response.efficiency)

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps:
        """Return the errors (channel, y, x) of the light of `mixed` from the kernels' errors.

        Parameters
        ----------
        mixed : mixed radiance (wavelength, y, x).
        weights : (channel, band) factors on irradiance, for every band of `mixed`.

        Returns
        -------
        `ErrorMaps` with one value per tile of the light that `image` returns.
        """
        part = self.region.of(mixed)
        deviation_and_bound = errors.spread_errors(part, self.optics, weights[:, self.region.kept])
        maps = ErrorMaps(*deviation_and_bound, KERNELS, "kernels beyond their exact core")
        return errors_on_window(maps, self.lens, self.optics, self.region.window_m)

    def _placed(
        self, values: np.ndarray, make_quantity: Callable[..., Any], first: ArrayLike, **attrs: Any
    ) -> xr.DataArray:
        """Return make_quantity(values, first, x, y, ...) of light that was moved to the sensor
        plane by distortion and lateral colour.
        """
        sensor = self.optics.sensor

        def placed(values_there: np.ndarray) -> xr.DataArray:
            return self._on_sensor(make_quantity, values_there, first, **attrs)

        if sensor.keeps_grid:
            return placed(values)
        moved = sensor.move(values)
        if ledger.records_errors():
            losses = retiling.losses(sensor, values, moved)
            ledger.record(*losses.terms)
            ledger.light_part(retiling.DETAIL, placed(losses.within_tiles), within_tiles=True)
            if losses.of_border is not None:
                ledger.light_part(retiling.BORDER, placed(losses.of_border))
        return placed(moved)

    def _on_sensor(
        self, make_quantity: Callable[..., Any], values: np.ndarray, first: ArrayLike, **attrs: Any
    ) -> xr.DataArray:
        """Return make_quantity(values, first, x, y, ...) with the attributes of the lens."""
        lens = self.lens
        optics = self.optics
        f_m = 1e-3 * lens.focal_length_mm
        # includes the loss by flares, as a mean over all bands
        throughput_sr = lens.throughput_sr() * float(
            np.mean(optics.gains / lens.gains_sr(optics.wavelength_nm))
        )
        light = make_quantity(
            values,
            first,
            optics.sensor.x * f_m,
            optics.sensor.y * f_m,
            f_number=lens.f_number,
            focal_length_mm=lens.focal_length_mm,
            throughput_sr=throughput_sr,
            field_width=optics.sensor.field[0] * f_m,
            field_height=optics.sensor.field[1] * f_m,
            **optics.sensor.attrs,
            **attrs,
        )
        for name, dim, pitch_um in (
            ("pitch_x", "x", optics.pitch_um[1]),
            ("pitch_y", "y", optics.pitch_um[0]),
        ):
            if light.sizes[dim] == 1:
                light.attrs[name] = pitch_um * 1e-6
        return light

    def _added(self, mixed: xr.DataArray) -> Iterator[np.ndarray]:
        """Yield irradiances (wavelength, y, x) that are added: the light that replaces truncated
        wings, and the light of flares.

        The second image of a windscreen loses the same share in the pupil as the first.
        """
        optics = self.optics
        shape = (len(optics.wavelength_nm), len(optics.sensor.y), len(optics.sensor.x))
        if isinstance(optics.kernels, wing_truncation.TruncatedKernels):
            yield (optics.kernels.added * optics.gains)[:, None, None]
        for flare in self.flares:
            if not isinstance(flare, AddsLight):
                continue
            if optics.sensor.keeps_grid:
                added = flare.irradiance(self.lens, mixed)
            else:
                covered = optics.sensor.covered(mixed)
                added = optics.sensor.cut(flare.irradiance(self.lens, covered))
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
            if isinstance(flare, WindscreenFlare):  # its light passes the pupil as the image does
                of_pupil = optics.gains / self.lens.throughput_sr()
                yield added.values * of_pupil[:, None, None]
            else:
                yield added.values
