"""The lens `measured`: tables of point spread functions or MTF, illumination and distortion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.projection import angle_rad
from isethdr_core.plugins.protocols import TransmitsPupil
from isethdr_core.plugins.ranges import check_ranges

from ..abilities import DrawsPupil
from ..measured.spread import Share, around, kernel, on_samples, shares, spread
from ..measured.table import MeasuredTable, load, table_path
from .limits import FNumber, FocalLength, Transmittance
from .thin_lens import IdealLens

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from ..flare.haze import HazeFlare


@dataclass(frozen=True)
class MeasuredLens:
    """Measured lens: point spread functions or MTF over field and wavelength, from a table."""

    THREAD_SAFE: ClassVar[bool] = True

    # the name example, or the path of a .npz with point spread functions or a .csv with MTF curves
    table: str = "example"
    # path of a .csv with field_deg and relative_illumination, distortion_percent, chief_ray_deg;
    # empty: those in the table
    figures: str = ""
    f_number: FNumber = 4.0  # focal length / diameter of the entrance pupil
    # focal length; without distortion, position on the sensor = focal length x tangent of the field
    # angle, or x the field angle in radians if the scene is equidistant
    focal_length_mm: FocalLength = 4.0
    transmittance: Transmittance = 1.0  # transmittance of the glass at all wavelengths
    # irradiance on the axis over radiance: tangent pi / (1 + 4 N^2), aplanatic (sine condition) pi
    # / (4 N^2)
    pupil: Literal["tangent", "aplanatic"] = "tangent"

    def __post_init__(self) -> None:
        check_ranges(self)
        self._table()

    def input_files(self) -> Iterable[Path]:
        """Return the files of the tables. Their content is part of a run's name."""
        beside = (Path(self.figures).expanduser(),) if self.figures else ()
        return (table_path(self.table), *beside)

    def image_size_m(
        self, width: float, height: float, projection: str = "tangent"
    ) -> tuple[float, float]:
        """Return (width, height) in metres of the largest centred rectangle of the sensor plane
        within the image of a field.

        Parameters
        ----------
        width, height : size of the field, in tangents of the field angle or in radians.
        projection : unit of both: `tangent` or `equidistant` (radians).

        Raises
        ------
        ConfigError : the field reaches beyond the table of illumination or distortion.
        """
        self._check_reach(width / 2, height / 2, projection)
        return self._geometry().image_size_m(width, height, projection)

    def __call__(
        self, mixed: xr.DataArray, flares: Sequence[Any] | dict[str, HazeFlare] = ()
    ) -> xr.DataArray:
        """Return irradiance of mixed radiance.

        Parameters
        ----------
        mixed : mixed radiance ([component,] wavelength, y, x).
        flares : sequence or dictionary of flares; their scatter and added light are applied.

        Raises
        ------
        ConfigError : a flare changes the light in the pupil, or the field reaches beyond the table
            of illumination or distortion.
        UnitError : `mixed` is not mixed radiance.
        """
        flare_list = tuple(flares.values()) if isinstance(flares, Mapping) else tuple(flares)
        if any(isinstance(f, TransmitsPupil | DrawsPupil) for f in flare_list):
            raise ConfigError(
                "a flare changes the light in the pupil, and a measured lens has no pupil; expected"
                " flares that scatter or add light; type ~flare.dirt"
            )
        quantities.check_mixed(mixed.isel(component=0) if "component" in mixed.dims else mixed)
        reach = [float(abs(mixed[d]).max()) for d in ("x", "y")]
        self._check_reach(*reach, mixed.attrs.get("projection", "tangent"))
        light = self._geometry()(mixed, flare_list)
        table = self._table()
        places = _places(self._radii(table.field_deg, light), table, light)
        tile_um = tuple(1e6 * quantities.tile_pitch(light, d) for d in ("y", "x"))
        out = np.empty(light.shape, np.float32)
        for band, wave in enumerate(light.wavelength.values):
            kernels = [
                (s, _kernel(table, s.ring, s.azimuth_rad, float(wave), tile_um)) for s in places
            ]
            for plane in np.ndindex(light.shape[:-3]):
                out[(*plane, band)] = spread(light.values[(*plane, band)].astype(float), kernels)
        self._state(table, light)
        return self._with_chief_rays(light.copy(data=out))

    def psf(self, wavelength_nm: ArrayLike, pitch_um: float = 1.0, size: int = 256) -> xr.DataArray:
        """Return the point spread function on the axis, integrated over samples.

        Parameters
        ----------
        wavelength_nm : one or more wavelengths, nm.
        pitch_um : distance of the samples, um.
        size : number of samples along each axis; the optical axis is at index size // 2.

        Returns
        -------
        DataArray (wavelength, y, x), y and x in metres: the share of a point's light on each
        sample.
        """
        waves = np.atleast_1d(np.asarray(wavelength_nm, float))
        table = self._table()
        out = np.zeros((len(waves), size, size))
        for band, wave in enumerate(waves):
            on_axis = _between_waves(table, 0, float(wave))
            out[band] = on_samples(on_axis, table.pitch_um, pitch_um, size)
        axis = 1e-6 * pitch_um * (np.arange(size) - size // 2)
        return quantities.plane(out, waves, axis, axis, "1")

    def _check_reach(self, half_width: float, half_height: float, projection: str) -> None:
        """Refuse a field that reaches beyond the table of illumination or distortion."""
        reached = float(np.degrees(angle_rad(half_width, half_height, projection)))
        for name, (angles, _) in self._table().figures.items():
            if name != "chief_ray_deg" and reached > angles[-1] * (1 + 1e-9):
                raise ConfigError(
                    f"{name} of {self.figures or self.table} ends at {angles[-1]:g} degrees, and"
                    f" the corners of the field lie at {reached:.3g}; expected a table that reaches"
                    " them; type a smaller scene.horizontal_field_deg, or less overscan"
                    " (renderer.margin)"
                )

    def _table(self) -> MeasuredTable:
        return load(self.table, self.figures, self.f_number)

    def _geometry(self) -> IdealLens:
        """Return the lens without blur that has this lens's illumination and distortion."""
        figures = self._table().figures
        more = {}
        if "relative_illumination" in figures:
            angles, values = figures["relative_illumination"]
            more["falloff"] = dict(zip(angles.tolist(), (values / values[0]).tolist()))
        if "distortion_percent" in figures:
            angles, values = figures["distortion_percent"]
            radius = np.tan(np.radians(angles[1:])) * (1 + values[1:] / 100)
            more["distortion"] = {
                "model": "table",
                "angle_deg": angles[1:].tolist(),
                "radius_per_focal_length": radius.tolist(),
            }
        return IdealLens(
            self.f_number, self.focal_length_mm, self.transmittance, self.pupil, **more
        )

    def _with_chief_rays(self, light: xr.DataArray) -> xr.DataArray:
        """Return light with the chief rays of the table as an attribute; without such a table,
        remove those of the lens without blur, which has another pupil.
        """
        light.attrs.pop("chief_rays", None)
        figures = self._table().figures
        if "chief_ray_deg" in figures:
            angles, chief_deg = figures["chief_ray_deg"]
            if light.attrs.get("projection") != "equidistant":
                with_tangent = angles < 90
                angles = angles[with_tangent]
                chief_deg = chief_deg[with_tangent]
            light.attrs["chief_rays"] = {
                "radius_per_focal_length": list(self._radii(angles, light)),
                "angle_deg": chief_deg.tolist(),
            }
        return light

    def _radii(self, field_deg: np.ndarray, light: xr.DataArray) -> tuple[float, ...]:
        """Return the radii on the sensor of field angles, in focal lengths."""
        table = self._table()
        angles = np.radians(field_deg)
        if "distortion_percent" in table.figures:
            table_percent, percent = table.figures["distortion_percent"]
            scale = 1 + np.interp(field_deg, table_percent, percent) / 100
            return tuple((np.tan(angles) * scale).tolist())
        is_equidistant = light.attrs.get("projection") == "equidistant"
        return tuple((angles if is_equidistant else np.tan(angles)).tolist())

    def _state(self, table: MeasuredTable, light: xr.DataArray) -> None:
        _state_interpolation(table)
        outside = 1 - float(table.energy.min())
        if outside > 0:
            label = "PSF energy beyond the samples of the table, assigned to the samples, L1"
            ledger.error(2 * outside, "relative", "bound", label, key="beyond the samples")
        if table.clipped:
            label = "negative values in PSFs computed from MTF curves, set to 0"
            ledger.error(table.clipped, "relative", "measured", label, key="phase of the MTF")
        waves = light.wavelength.values
        beyond = [w for w in waves if not table.wavelength_nm[0] <= w <= table.wavelength_nm[-1]]
        if beyond:
            ledger.left_out(
                f"PSFs of {len(beyond)} of {len(waves)} bands beyond the wavelengths of the table",
                f"the PSFs at {table.wavelength_nm[0]:g} and {table.wavelength_nm[-1]:g} nm are"
                " used",
                _change(table.psf, 1, -2),
                "relative, between the last two wavelengths of the table",
            )
        half = [1e-3 / self.focal_length_mm, np.hypot(*(float(abs(light[d]).max()) for d in "xy"))]
        corner = 1e6 * half[0] * half[1]
        if corner > self._radii(table.field_deg, light)[-1] * (1 + 1e-9):
            ledger.left_out(
                f"PSFs beyond the last angle of the table, {table.field_deg[-1]:g} degrees",
                "the PSF of the last angle is used",
                _change(table.psf, 0, -2),
                "relative, between the last two angles of the table",
            )
        if "chief_ray_deg" in table.figures:
            ledger.left_out(
                "angle of the chief ray",
                "only sensors with microlens_cra_deg depend on it",
                float(np.abs(table.figures["chief_ray_deg"][1]).max()),
                "degrees",
            )


def _state_interpolation(table: MeasuredTable) -> None:
    """State in the ledger the error of point spreads that are interpolated between two of the
    table.

    Each point spread of the table is left out in turn and interpolated from its neighbours. The
    table's own intervals are half as long, so that the error of linear interpolation is a quarter.
    """
    for axis, name in ((0, "angles"), (1, "wavelengths")):
        count = table.psf.shape[axis]
        label = f"point spreads between {name} of the table, share of a point's light, L1"
        if count > 2:
            coordinate = (table.field_deg, table.wavelength_nm)[axis]
            largest = max(
                _left_out_error(table.psf, coordinate, axis, k) for k in range(1, count - 1)
            )
            ledger.error(largest / 4, "relative", "measured", label, key=name)
        elif count == 2:
            ledger.error(_change(table.psf, axis, 0) / 2, "relative", "bound", label, key=name)


def _left_out_error(psf: np.ndarray, at: np.ndarray, axis: int, k: int) -> float:
    low, middle, high = (psf.take(k + d, axis) for d in (-1, 0, 1))
    part = (at[k] - at[k - 1]) / (at[k + 1] - at[k - 1])
    return float(np.abs((1 - part) * low + part * high - middle).sum((-2, -1)).max())


def _change(psf: np.ndarray, axis: int, first: int) -> float:
    """Return the L1 difference between two neighbours along an axis; 1 if there is only one."""
    if psf.shape[axis] < 2:
        return 1.0
    second = first + 1
    return float(np.abs(psf.take(second, axis) - psf.take(first, axis)).sum((-2, -1)).max())


def _places(radii: tuple[float, ...], table: MeasuredTable, light: xr.DataArray) -> list[Share]:
    f_m = 1e-3 * light.attrs["focal_length_mm"]
    return shares(table, np.array(radii), light.x.values / f_m, light.y.values / f_m)


@lru_cache(maxsize=4096)
def _kernel(
    table: MeasuredTable,
    ring: int,
    azimuth_rad: float,
    wavelength_nm: float,
    tile_um: tuple[float, float],
) -> np.ndarray:
    """Return the kernel of a field point and a band on tiles, interpolated between the wavelengths
    of the table.
    """
    return kernel(_between_waves(table, ring, wavelength_nm), table.pitch_um, tile_um, azimuth_rad)


def _between_waves(table: MeasuredTable, ring: int, wavelength_nm: float) -> np.ndarray:
    """Return the point spread (y, x) of a field angle, interpolated between the wavelengths of the
    table.
    """
    parts = [part * table.psf[ring, k] for k, part in around(table, wavelength_nm)]
    return np.sum(parts, axis=0)
