"""Path integrator: one path computes all bands and all light groups.

A path carries packets of four wavelengths, one wavelength per band (`spectra.py`). Its result is an
unbiased estimate of the mean over each band. All bands and groups share the directions of a path.
The shadow rays of each group have their own random numbers. The light of a group is therefore the
same, bit for bit, whether other groups are rendered or not. `visible_lamps.py` computes directly
visible lamps.

Compiled code (`tracing`) follows eight or sixteen paths at a time. Several paths may share a camera
ray: they continue from the same first surface with their own wavelengths and directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.data.fog import Fog
from isethdr_core.physics.photometry import xyz_weights

from ..lamps.airlight_sampling import AirlightLamps
from ..lamps.lamp_tables import LampTables
from ..world.geometry import World
from ..world.view import View
from .camera_rays import Camera
from .device_memory import aligned
from .fog_tables import FogTables
from .hits import HitTables
from .spectra import BandTable
from .surface_tables import SurfaceTables
from .tracing.launch_tables import Items, Spectra, Tables
from .tracing.trace import traced
from .work_items import Work, divide_launches, even_work


class Found(NamedTuple):
    """Results of a launch, summed over paths."""

    # (group, band, entry) float32, W m-2 sr-1 nm-1; copies of the last band round the number of
    # bands up to a multiple of four
    radiance: np.ndarray
    batches: np.ndarray  # (group, 3, item) float32: X, Y and Z, cd/m2


@dataclass(eq=False)
class Launch:
    """A recorded launch of compiled code. Once started, it runs in parallel with Python.

    Dr.Jit can only wait for all launches together. Call `wait` on the previous launch before
    starting the next one.

    Attributes
    ----------
    radiance : [group][band] arrays (entry,) on the device.
    batches : [group][channel] arrays (item,) on the device.
    """

    radiance: list[list[Any]]
    batches: list[list[Any]]

    def start(self) -> None:
        """Start the launch, and return at once."""
        dr.eval(self.radiance, self.batches)

    def wait(self) -> None:
        """Wait until the launch has ended. Results in the memory of the processor are not copied
        here, so that the next launch can start.
        """
        dr.sync_thread()
        self.radiance, self.batches = (
            [[each.numpy() for each in group] for group in arrays]
            for arrays in (self.radiance, self.batches)
        )

    def found(self) -> Found:
        """Return the results, after `wait`."""
        return Found(np.array(self.radiance), np.array(self.batches))


@dataclass(frozen=True, eq=False)
class Paths:
    """Integrator over one world. Any list of tiles is one launch of the same kernel.

    Attributes
    ----------
    world : scene with ramp surfaces (`materials.ramp_surfaces`).
    view : tiles of the frame.
    lamps : light groups and lamps.
    surfaces : materials of the world.
    wavelength_nm, step_nm : band centres (band,) and their common width, nm.
    max_depth : largest number of segments of a path; 2 is direct light only.
    fog : fog of the scene; None in clear air. With fog, the sky must be uniform.
    """

    world: World
    view: View
    lamps: LampTables
    surfaces: SurfaceTables
    wavelength_nm: np.ndarray
    step_nm: float
    max_depth: int
    fog: Fog | None = None

    def __post_init__(self) -> None:
        divide_launches()
        self.lamps.fog = self._fog
        self.lamps.aim(self.world.scene, self._hits, self._camera, self.view, self.surfaces)

    @cached_property
    def _fog(self) -> FogTables | None:
        if self.fog is None:
            return None
        return FogTables(self.fog, self.wavelength_nm, float(self.view.origin_m[2]))

    @cached_property
    def _air(self) -> AirlightLamps | None:
        if self._fog is None:
            return None
        air = AirlightLamps(self.lamps, self._fog)
        air.aim(self.world.scene, self._hits, self._camera, self.view)
        return air

    @cached_property
    def _hits(self) -> HitTables:
        return HitTables(self.world)

    @cached_property
    def _camera(self) -> Camera:
        return Camera(self.view)

    @cached_property
    def _table(self) -> BandTable:
        rows = np.vstack([self.surfaces.reflectance, self.lamps.emission])
        return BandTable(rows, self.wavelength_nm, self.step_nm, means=self.lamps.sky_rows)

    @cached_property
    def _weights(self) -> list[list[Any]]:
        """Return the weights of X, Y and Z on the device, in packets."""
        weights = np.zeros((3, 4 * self._table.packets))
        weights[:, : len(self.wavelength_nm)] = xyz_weights(self.wavelength_nm)
        number = lambda v: dr.opaque(mi.Float, float(v))
        return [[mi.Spectrum(*map(number, part)) for part in row.reshape(-1, 4)] for row in weights]

    def all_groups(self) -> int:
        """Return a bit mask with the bits of all light groups set."""
        return (1 << len(self.lamps.groups)) - 1

    def even_pass(
        self, seed: int, samples: int, group_numbers: Sequence[int] | None = None
    ) -> np.ndarray:
        """Return radiance (group, band, tile), W m-2 sr-1 nm-1, summed over `samples` paths of each
        tile.

        Parameters
        ----------
        seed : seed of the random numbers.
        samples : number of paths per tile, at most 1024, because the sum is float32.
        group_numbers : numbers of the light groups to compute; others are 0. None: all.
        """
        groups = (
            self.all_groups() if group_numbers is None else sum(1 << int(g) for g in group_numbers)
        )
        tiles = self.view.shape[0] * self.view.shape[1]
        return self.launch(seed, even_work(tiles, samples, groups)).radiance

    def launch(self, seed: int, work: Work) -> Found:
        """Follow the paths of `work`, and return the results. The random numbers of a tile depend
        only on the seed, the stream and the tile, not on the other tiles in the list.
        """
        launch = self.record(seed, work)
        launch.start()
        launch.wait()
        return launch.found()

    def record(self, seed: int, work: Work) -> Launch:
        """Return the launch that follows the paths of `work`, without starting it. This takes
        Python a quarter of a second, during which the previous launch can run.
        """
        # Numbers are data instead of literals, so that one kernel serves all lists, all sets of
        # light groups, and all scenes with the same kinds of surfaces.
        number = lambda v: dr.opaque(mi.UInt32, int(v))
        table = self._table
        spectra = Spectra(
            table.on_device(np.random.default_rng(seed).random()),
            number(len(table.rows) + table.means),
            number(len(self.surfaces.reflectance)),
            number(table.places),
            table.packets,
        )
        column = work.tiles % self.view.shape[1]
        row = work.tiles // self.view.shape[1]
        row = row + self.view.cut[0]
        column = column + self.view.cut[1]
        # the random numbers of a tile depend on its stream and on its number in the complete grid
        rows, columns = self.view.whole
        stream_numbers = (work.streams * rows + row) * columns + column
        device_vector = lambda values: mi.UInt32(aligned(values, np.uint32))
        at_items = lambda values: device_vector(values[work.owner])
        items = Items(
            at_items(row),
            at_items(column),
            at_items(stream_numbers),
            *map(
                device_vector,
                (work.owner, work.lane, work.lanes, work.paths, work.shares, work.groups),
            ),
        )
        tables = Tables(
            self.world.scene, self._hits, self._camera, self.lamps, self.surfaces, spectra
        )
        tables.fog = self._fog
        tables.air = self._air
        key = number(seed & 0xFFFFFFFF)
        return Launch(*traced(tables, key, items, len(work.tiles), self._weights, self.max_depth))
