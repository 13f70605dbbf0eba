"""Paths of one job. Its scene and tables are made once, for studies that render it many times."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.frame import Built, Cube, follower
from isethdr_mitsuba.labels import instances
from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
from isethdr_mitsuba.lamps.sky_discs import disc_lamps
from isethdr_mitsuba.lamps.visible_lamps import Bands, visible_lamps
from isethdr_mitsuba.paths.work_items import listed_work
from isethdr_mitsuba.world.geometry import build_world
from isethdr_mitsuba.world.materials import ramp_surfaces
from isethdr_mitsuba.world.view import View, view_of

import isethdr_core as hdr
from isethdr_core.demand import NoiseLimit
from isethdr_core.extras import needed
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.uncertainty.ledger import Ledger

with needed("a study of the renderer", extra="mitsuba"):
    import mitsuba as mi

Array = npt.NDArray[np.float64]
LAUNCH = 4096  # most paths of a tile in one launch; longer float32 sums lose precision


@dataclass(frozen=True, eq=False)
class JobPaths:
    """The scene of a job, ready to follow paths as `isethdr_mitsuba.frame.render_frame` does.

    Attributes
    ----------
    renderer : renderer with its settings.
    paths : the integrator, `isethdr_mitsuba.paths.integrator.Paths`.
    view : the camera's view of the scene.
    demand : what the cameras need of the rendering.
    layer : (group, band, tile) radiance of directly visible lamps, which has no noise.
    instance : (row, column) number of the object in each tile.
    cpu_s : CPU time to make the scene and its tables, s.
    """

    renderer: Any
    paths: Any
    view: View
    demand: Any
    layer: Array
    instance: npt.NDArray[np.int64]
    cpu_s: float

    @property
    def groups(self) -> list[str]:
        """Return the names of the light groups."""
        return list(self.paths.lamps.groups)

    def luminance(self, radiance: Array) -> Array:
        """Return luminance (group, tile), cd/m2, of radiance (group, band, tile)."""
        return np.einsum("b,gbt->gt", xyz_weights(self.paths.wavelength_nm)[1], radiance)

    def limit(self, radiance: Array) -> NoiseLimit:
        """Return the cameras' noise limits for radiance (group, band, tile) without `layer`."""
        cube = Cube(self.groups, self.paths.wavelength_nm, self.view)
        whole = (radiance + self.layer).reshape(*self.layer.shape[:2], *self.view.shape)
        return self.demand.noise_limit(cube.dataset(whole))

    def of_tiles(self, seed: int, tiles: npt.NDArray[np.int64], paths: int) -> Array:
        """Return radiance (group, band, tile) of some tiles after a number of paths, without
        `layer`.

        Parameters
        ----------
        seed : seed of the paths.
        tiles : (tile,) numbers of the tiles, sorted.
        paths : number of paths through each tile.
        """
        bands = len(self.paths.wavelength_nm)
        light = np.zeros((len(self.groups), bands, len(tiles)))
        every = np.full(len(tiles), self.paths.all_groups())
        done = 0
        while done < paths:
            now = min(LAUNCH, paths - done)
            work = listed_work(tiles, np.full(len(tiles), now), every)
            sums = self.paths.launch(seed + done, work).radiance[:, :bands]
            light[:, :, np.searchsorted(tiles, work.tiles)] += sums.astype(float)
            done += now
        return light / done


def job_paths(overrides: list[str]) -> JobPaths:
    """Return the paths of the main job with `overrides`."""
    start = time.process_time()
    built = chain(hdr.compose(overrides))
    renderer = built.renderer
    demand = plan(built, Ledger())
    description = built.scene()
    groups = renderer._groups(description, demand)
    bands = renderer._bands(demand)
    mi.set_variant(choose_variant(renderer.variant))
    view = view_of(description.camera, renderer.width, renderer.height, renderer.margin)
    if not demand.margin:
        view = view.within_field()
    lamps = placed_lamps(description, renderer.normalise, groups)
    lamps += disc_lamps(description, "sky" in groups)
    surfaces = ramp_surfaces(description)
    world = build_world(description, surfaces)
    layer, _ = visible_lamps(
        world, view, lamps, groups, Bands(bands, renderer.step_nm), description.fog
    )
    cube = Cube(groups, bands, view)
    paths = follower(description, Built(world, surfaces), lamps, cube, renderer)
    flat_layer = layer.reshape(*layer.shape[:2], -1).astype(float)
    instance = instances(world, view)
    cpu_s = time.process_time() - start
    return JobPaths(renderer, paths, view, demand, flat_layer, instance, cpu_s)
