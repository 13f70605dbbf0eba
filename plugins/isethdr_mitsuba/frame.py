"""One rendered frame: world, passes, directly visible lamps, labels, and the resulting Dataset."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.quantities import scene_radiance
from isethdr_core.runs.sample_accumulation import Known

from .fog import in_fog, state_fog
from .lamps.placed_lamps import placed_lamps
from .lamps.sky_discs import disc_lamps
from .paths.passes import Frame, estimate
from .world.coat_energy import lost_light
from .world.materials import ramp_surfaces
from .world.view import View, view_of

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.data.scene_description import SceneDescription
    from isethdr_core.demand import Demand

    from .lamps.placed_lamps import PlacedLamp
    from .paths.by_need.rounds import Rounds
    from .paths.integrator import Paths
    from .paths.passes import Estimate
    from .renderer import MitsubaRenderer
    from .world.geometry import World


LARGEST_SAMPLES = 10_000_000  # largest number of samples per tile; noise is 0.03 % of one path's


@dataclass(frozen=True)
class Request:
    """Light groups, bands, accuracy and stored samples of one rendering."""

    groups: list[str]  # light groups; each has an emitter
    bands_nm: np.ndarray  # (band,) centres, nm
    demand: Demand  # needs of later stages; its `noise_limit` counts if no noise is set
    # samples of earlier renderings, which are not computed again
    known: dict[str, Known] | None = None


def render_frame(
    settings: MitsubaRenderer, description: SceneDescription, request: Request, variant: str
) -> xr.Dataset:
    """Return the scene radiance Dataset.

    Parameters
    ----------
    settings : settings of the renderer.
    description : scene to render.
    request : light groups, bands and accuracy.
    variant : Mitsuba variant that works on this machine.
    """
    import mitsuba as mi

    mi.set_variant(variant)
    from .labels import category_numbers, check_labels, cut_labels, label_tiles
    from .lamps.visible_lamps import Bands, visible_lamps
    from .world.geometry import build_world

    description = in_fog(description, variant)
    check_labels(request.demand.labels, moves=description.next_frame is not None)
    if request.demand.labels:
        category_numbers(description)  # refuses unknown categories before rendering
    groups = request.groups
    wide = view_of(description.camera, settings.width, settings.height, settings.margin)
    # the random numbers of Mitsuba's own film depend on the size of the frame
    whole = request.demand.margin or is_scalar(variant)
    view = wide if whole else wide.within_field()
    lamps = placed_lamps(description, settings.normalise, groups)
    lamps += disc_lamps(description, "sky" in groups)
    surfaces = ramp_surfaces(description)
    if is_scalar(variant):
        state_lost_light(description)
    built = Built(build_world(description, surfaces), surfaces)
    bands = Bands(request.bands_nm, settings.step_nm)
    layer, error = visible_lamps(built.world, view, lamps, groups, bands, description.fog)
    frame = FrameOfScene(description, built, lamps, Cube(groups, request.bands_nm, view), variant)
    result, share = followed_light(settings, frame, request, layer)
    np.add(result.radiance, layer, out=result.radiance)
    by_need = share is not None and not is_scalar(variant)
    state_noise(result, groups, settings if by_need else settings.decided())
    state_fog(description.fog, any(p.peak_cd_m2 > 0 for p in lamps), "sky" in groups)
    state_hidden_lamps(error, view)
    # an object may extend beyond the field
    labels, objects = cut_labels(
        view.cut,
        *label_tiles(built.world, wide, description, request.demand.labels, settings.normalise),
    )
    ds = with_noise(frame.cube.dataset(result.radiance, **labels), result, groups)
    if share is not None:
        ds.attrs["limit_share"] = share
    if objects is not None:
        ds.attrs["objects"] = objects
    ds.attrs["lamps"] = rows_of(lamps, groups)
    return ds


def is_scalar(variant: str) -> bool:
    """Return whether a variant of Mitsuba works without a compiler."""
    return variant.startswith("scalar")


def state_lost_light(description: SceneDescription) -> None:
    """State the light lost because Mitsuba's own materials do not follow light from one facet of a
    rough surface to another.
    """
    lost_share, worst = lost_light(description.materials.values())
    if lost_share > 0:
        why = (
            f"Mitsuba's materials scatter once; the loss is largest at grazing angles, for {worst}"
        )
        ledger.left_out(
            "light between facets of rough surfaces", why, lost_share, "relative", key="facets"
        )


def state_hidden_lamps(error: float, view: View) -> None:
    """State the error of lamps that are partly hidden within a tile.

    Parameters
    ----------
    error : relative error; nothing is stated for 0.
    view : tiles of the frame.
    """
    if error > 0:
        arcs = ", or where its sides are arcs" * (view.projection != "tangent")
        ledger.error(
            error,
            "relative",
            "bound",
            f"part of a lamp's footprint on a tile, where the lamp is partly hidden{arcs}",
        )


def with_noise(ds: xr.Dataset, result: Estimate, groups: Sequence[str]) -> xr.Dataset:
    """Return scene radiance with variables for its noise, from which the share of renderer noise in
    a picture can be computed.

    Parameters
    ----------
    ds : scene radiance.
    result : estimate from which `ds` was made.
    groups : names of the light groups, in the order of `result`.
    """
    units = {"units": "cd m-2"}
    noise = result.xyz_noise.astype(np.float32)
    half_difference = result.half_difference.astype(np.float32)
    ds["xyz_noise"] = ("light_group", "xyz_channel", "y", "x"), noise, units
    ds["half_difference"] = ("light_group", "y", "x"), half_difference, units
    ds.attrs["noise"] = {
        g: float(n) for g, n in zip(groups, result.noise, strict=True) if np.isfinite(n)
    }
    ds.attrs["path_span"] = {
        g: [int(first), int(first + n)]
        for g, first, n in zip(groups, result.first, result.samples, strict=True)
    }
    return ds


def rows_of(lamps: Sequence[PlacedLamp], groups: Sequence[str]) -> list[dict[str, Any]]:
    """Return one row for each lamp of the light groups, for the attributes of scene radiance."""
    return [
        {
            "object": placed.object,
            "instance": placed.instance,
            "kind": placed.lamp.kind,
            "group": placed.lamp.group,
            "luminance_cd_m2": placed.peak_cd_m2,
        }
        for placed in lamps
        if placed.lamp.group in groups
    ]


@dataclass(frozen=True)
class FrameOfScene:
    """A scene, its Mitsuba objects, and the grid, bands and light groups to render."""

    description: SceneDescription
    built: Built
    lamps: list[PlacedLamp]
    cube: Cube
    variant: str


def followed_light(
    settings: MitsubaRenderer, frame: FrameOfScene, request: Request, layer: np.ndarray
) -> tuple[Estimate, float | None]:
    """Return the radiance found by paths, and the share of the cameras' noise for which it was
    computed. The share is None if no camera limits the noise. Mitsuba's own integrator follows the
    same paths for any share.

    Parameters
    ----------
    settings : `MitsubaRenderer`: seed, samples and limits.
    frame : the scene, its view, bands and light groups.
    request : accuracy and samples of earlier renderings.
    layer : (group, wavelength, row, column) radiance of the lamps that the camera sees directly,
        W m-2 sr-1 nm-1.
    """
    cube = frame.cube
    view = cube.view
    demand = request.demand
    share = None if demand.noise_limit is None else settings.limit_share()
    if is_scalar(frame.variant):
        from .paths.film_bands import film_pass

        one_pass = film_pass(
            frame.description, view, frame.lamps, cube.groups, cube.bands_nm, settings
        )
    else:
        paths = follower(frame.description, frame.built, frame.lamps, cube, settings)
        one_pass = even_passes(paths)
        if share is not None:
            from .labels import instances

            limit_at = lambda radiance: demand.noise_limit(
                cube.dataset(radiance.reshape(layer.shape) + layer)
            )
            objects = instances(frame.built.world, view)
            return needed_paths(settings, paths, objects, view, limit_at, request.known)
    grid = Frame(cube.groups, cube.bands_nm, view.shape, view.whole, view.in_field())
    return estimate(one_pass, settings.decided(), grid, request.known), share


class Cube(NamedTuple):
    """Grid, bands and light groups of scene radiance."""

    groups: list[str]
    bands_nm: np.ndarray
    view: View

    def dataset(self, radiance: np.ndarray, **labels: Any) -> xr.Dataset:
        """Return the labelled Dataset of an array (group, wavelength, row, column) of radiance."""
        view = self.view
        ds = scene_radiance(
            radiance,
            self.groups,
            self.bands_nm,
            view.x,
            view.y,
            view.field,
            view.projection,
            **labels,
        )
        # a single band or tile has no neighbour from which its width follows
        ds.attrs.update(pitch_x=view.pitch_x, pitch_y=view.pitch_y)
        return ds


def needed_paths(
    settings: MitsubaRenderer,
    paths: Paths,
    instance: np.ndarray,
    view: View,
    limit_at: Callable[..., Any],
    known: Known | None,
) -> tuple[Estimate, float]:
    """Return the estimate with more paths where the cameras need them (`paths.by_need`), and
    its noise as a share of the cameras' noise.

    Parameters
    ----------
    settings : `MitsubaRenderer`: seed, samples and limits.
    paths : `paths.integrator.Paths` of all groups.
    instance : (row, column) object of each tile.
    limit_at : function(radiance) -> `NoiseLimit`.
    view : tiles of the frame.
    known : {light group: light of earlier renderings}, or None.
    """
    from .paths.by_need import rounds as by_need

    known = [(known or {}).get(group, Known()) for group in paths.lamps.groups]
    first = max(k.next for k in known)
    most_mean = settings.most_mean_samples or math.inf
    rounds = by_need.Rounds(
        paths,
        instance,
        settings.seed,
        first,
        settings.most_samples,
        most_mean,
        view.in_field(),
    )
    share = settings.limit_share()
    seconds = by_need.render_by_need(rounds, limit_at, share)
    reached = share / math.sqrt(rounds.affordable)
    if rounds.affordable < 1:
        ledger.left_out(
            f"samples beyond {most_mean:.4g} per tile, mean over the tiles, all light groups"
            " together",
            f"renderer.most_mean_samples; the noise is {reached:.2g} times that of the cameras,"
            f" {share:.2g} times was requested",
            reached / share,
            "times the noise asked for",
            key="mean samples",
        )
    state_rare_light(rounds)
    return by_need.estimate(rounds, known, seconds, view.in_field()), reached


def state_rare_light(rounds: Rounds) -> None:
    """State how much light of rare bright paths was moved between tiles.

    Parameters
    ----------
    rounds : the paths of a rendering.
    """
    moved = rounds.moved
    if moved is not None and moved.tiles.any():
        most = int(np.argmax(moved.light))
        ledger.left_out(
            "the place of the light of rare bright paths",
            f"found in {moved.tiles.sum()} tiles, it is distributed over the tiles around them; at"
            f" most {moved.light[most]:.1%} of a light group"
            f" ({rounds.paths.lamps.groups[most]}); further paths tested {rounds.checked} bright"
            " tiles",
            moved.most,
            "times the noise of the cameras",
            key="rare light",
        )


class Built(NamedTuple):
    """The Mitsuba objects of a scene."""

    world: World
    surfaces: dict  # result of `world.materials.ramp_surfaces` with which the world was built


def follower(
    description: SceneDescription,
    built: Built,
    lamps: Sequence[Any],
    cube: Cube,
    settings: MitsubaRenderer,
) -> Paths:
    """Return the integrator of all bands and groups of `cube` over a world
    (`paths.integrator.Paths`).

    Parameters
    ----------
    description : scene.
    built : world and surfaces of the scene.
    lamps : placed lamps of all groups.
    cube : view, bands and light groups that are wanted.
    settings : `MitsubaRenderer`: depth and width of the bands.
    """
    from .lamps.lamp_tables import LampTables
    from .paths.integrator import Paths
    from .paths.surface_tables import SurfaceTables

    world = built.world
    groups = cube.groups
    materials = SurfaceTables(world, description.materials.values(), built.surfaces.values())
    sky = description.sky if "sky" in groups else None
    tables = LampTables(world, lamps, groups, sky, description.openings)
    depth = settings.max_depth
    step_nm = settings.step_nm
    fog = description.fog
    return Paths(world, cube.view, tables, materials, cube.bands_nm, step_nm, depth, fog)


def even_passes(paths: Paths) -> Callable[..., Any]:
    """Return the function that `passes.estimate` calls for each pass. A pass covers all tiles
    evenly.
    """
    groups = len(paths.lamps.groups)
    bands = len(paths.wavelength_nm)

    def one_pass(
        seed: int, samples: int, groups_wanted: Sequence[int] | None = None
    ) -> Iterator[Any]:
        sums = paths.even_pass(seed, samples, groups_wanted)
        for g in range(groups) if groups_wanted is None else groups_wanted:
            for band in range(bands):
                yield g, band, sums[g, band].astype(float) / samples

    return one_pass


def largest_noise_factor(samples: int) -> float:
    """Return a factor: for nine of ten tiles, the true noise is at most this factor times the
    stated noise. Light that only few paths find makes the stated noise too small.

    The factor was measured on a night drive and in a tunnel, for the worst light group, against
    references of at least 2400 paths. It is smallest from 160 paths on.
    """
    return float(
        np.interp(np.log2(max(samples, 1)), np.log2([16, 32, 64, 160]), [5.2, 3.8, 2.8, 2.1])
    )


def state_noise(result: Estimate, groups: Sequence[str], settings: MitsubaRenderer) -> None:
    """State the noise of each group in the ledger, and print a message if it exceeds the noise
    allowed.

    Parameters
    ----------
    result : `paths.passes.Estimate`.
    groups : names of the light groups, in the order of `result`.
    settings : `MitsubaRenderer`: samples and noise allowed.
    """
    for group, noise, own, known, seconds in zip(
        groups, result.whole_noise, result.samples, result.known, result.seconds, strict=True
    ):
        # a single pass has no spread, and a group without light has no noise
        if not np.isfinite(noise):
            continue
        samples = own + known.paths
        stored = f", {known.paths} of them stored before" * bool(known.paths)
        if settings.samples is None:
            how = "distributed by the need of the cameras"
        else:
            how = (
                "true noise of nine tiles in ten within"
                f" {largest_noise_factor(samples):.1f} times the noise stated of each"
            )
        ledger.error(
            noise,
            "relative",
            "statistical",
            f"noise of light group {group} after {samples} samples per tile{stored}, median over"
            f" tiles; {how}, {seconds:.3g} s",
            key="sampling noise",
            part=group,
        )
        if settings.error_allowed is not None and noise > settings.error_allowed:
            needed = math.ceil(samples * (noise / settings.error_allowed) ** 2)
            advice = f"type renderer.most_samples={needed}"
            if needed > LARGEST_SAMPLES:
                least = noise * math.sqrt(samples / LARGEST_SAMPLES)
                advice = (
                    f"it would need {needed:.2g} samples, more than the largest number,"
                    f" {LARGEST_SAMPLES}; type for example renderer.error_allowed={2 * least:.1g}"
                )
            print(
                f"renderer: light group {group} has a relative noise of {noise:.2g} after {samples}"
                f" samples per tile; {settings.error_allowed:g} is allowed; {advice}",
                file=sys.stderr,
                flush=True,
            )
