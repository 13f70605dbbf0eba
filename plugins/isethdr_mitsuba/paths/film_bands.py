"""The renderer for machines without a compiler: Mitsuba's own path integrator, one light group and
four bands at a time.

The code of a path is compiled. Lamps light surfaces as spots (`spots.py`). Only a lamp seen in a
mirror or through a pane calls Python. One scene holds all lamps, and the sampling weights of the
spots switch a group on. Other scenes hold the parts of the sky. With a film of exactly four bands
of equal width, Mitsuba takes exactly one wavelength per band and path. The same seed gives all
bands the same paths, so the choice of wavelength adds no noise, and colours stay consistent. The
seeds of a group depend on its name, so its light does not depend on the other groups.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from zlib import crc32

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core import ledger
from isethdr_core.data.sky import SkyDome, pattern_at, sky_direction

from ..lamps.beam_lamp import beam_lamp, film, sensor
from ..lamps.placed_lamps import SPECTRUM_NM, emission_table
from ..lamps.spot_shares import extent_error, illuminance, seen_points, shares
from ..lamps.spots import cone_deg, lost_beyond, spots
from ..world.angle_sensor import angle_sensor
from ..world.geometry import build_world
from ..world.materials import coloured_surfaces, regular, times
from ..world.view import check_square

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import SceneDescription, Spectrum

    from ..lamps.placed_lamps import PlacedLamp
    from ..lamps.spots import Spot
    from ..renderer import MitsubaRenderer
    from ..world.view import View

BLOCK = 4  # number of bands of one film; a path of Mitsuba carries four wavelengths
WITHIN = 20  # number of wavelengths in a band over which spectra are averaged
MAP = 512, 1024  # rows and columns of an environment map of the sky
# rotation from the axes of a Mitsuba environment map, with its zenith along y, to those of the
# world
UPRIGHT = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
# share of the luminance of a dry marking that is missing without beads, in light of the camera
# car's own headlamps: R_L is 77 instead of 150
LOST_BEADS = 0.5


def film_pass(
    description: SceneDescription,
    view: View,
    lamps: Sequence[PlacedLamp],
    groups: Sequence[str],
    bands_nm: np.ndarray,
    settings: MitsubaRenderer,
) -> Callable[..., Any]:
    """Return the function that `passes.estimate` calls for each pass.

    Parameters
    ----------
    description : scene.
    view : tiles of the frame.
    lamps : placed lamps.
    groups : names of the light groups.
    bands_nm : (band,) centres, nm.
    settings : `MitsubaRenderer`: size of the frame in tiles, path depth and width of the bands.
    """
    angles = view.projection == "equidistant"
    if not angles:
        check_square(settings.width, settings.height, view.field[0] / view.field[1])
    if any(m.retro and m.retro.form == "beads" for m in description.materials.values()):
        why = "they would need a Python call for each path: 14 times the cost"
        ledger.left_out("beads of road markings", why, LOST_BEADS, "relative", key="beads")
    if any(m.texture for m in description.materials.values()):
        why = "Mitsuba's own integrator uses the mean reflectance of each material"
        ledger.left_out("textures", why, 1.0, "relative", key="textures")
    tables = {p.lamp.table for p in lamps if p.grid is not None}
    wide, cone = max(((lost_beyond(t, cone_deg(t)), cone_deg(t)) for t in tables), default=(0, 0))
    if wide > 0:
        why = f"lamps with a table are rendered as spots, which end {cone:g} degrees off their axis"
        ledger.left_out("light far off a lamp's axis", why, wide, "relative", key="wide light")
    rows, columns = view.shape
    span = bands_nm[0] - settings.step_nm / 2, bands_nm[-1] + settings.step_nm / 2
    integrator = mi.load_dict({"type": "path", "max_depth": settings.max_depth, "rr_depth": 1000})
    # a short last block is filled up with the bands before it, so that every film has four bands of
    # equal area
    starts = sorted({min(s, max(len(bands_nm) - BLOCK, 0)) for s in range(0, len(bands_nm), BLOCK)})
    sensors = [
        mi.load_dict(
            (angle_sensor if angles else sensor)(
                view, film(_block(bands_nm, s, settings.step_nm), settings.step_nm, columns, rows)
            )
        )
        for s in starts
    ]
    sky = _sky_scenes(description, span, bands_nm, settings.step_nm) if "sky" in groups else []
    near = [p for p in lamps if p.instance]  # sun and moon belong to the scenes of the sky
    lamp_scene, switch = (
        _lamp_scene(description, view, near, groups, span)
        if any(p.lamp.group in groups for p in near)
        else (None, None)
    )

    every = range(len(groups))

    def one_pass(seed: int, samples: int, wanted: Sequence[int] = every) -> Iterator[Any]:
        for g, group in ((g, groups[g]) for g in wanted):
            lit = sky if group == "sky" else []
            if lamp_scene is not None and switch(group):
                lit = [*lit, (lamp_scene, np.ones(len(bands_nm)))]
            for scene, factor in lit:
                done = 0
                for start, one_sensor in zip(starts, sensors, strict=True):
                    image = np.array(
                        mi.render(
                            scene,
                            sensor=one_sensor,
                            integrator=integrator,
                            spp=samples,
                            seed=seed ^ crc32(group.encode()),
                        )
                    )
                    for k in range(max(start, done), min(start + BLOCK, len(bands_nm))):
                        yield g, k, image[..., k - start].ravel() * factor[k] / settings.step_nm
                    done = start + BLOCK

    return one_pass


def _block(bands_nm: np.ndarray, start: int, step_nm: float) -> list[float]:
    """Return four band centres from number `start` on. Missing bands are added beyond the
    last one.
    """
    block = list(bands_nm[start : start + BLOCK])
    return block + [block[-1] + step_nm * (k + 1) for k in range(BLOCK - len(block))]


def _sky_scenes(
    description: SceneDescription, span: tuple[float, float], bands_nm: np.ndarray, step_nm: float
) -> list[tuple[Any, np.ndarray]]:
    """Return the scenes of the parts of the sky, each with a factor per band. The light of the sky
    is the sum over the scenes, each times its factor.

    Parameters
    ----------
    description : scene with its sky; without a sky there is no scene.
    span : shortest and longest wavelength of the reflectances, nm.
    bands_nm : (band,) centres, nm.
    step_nm : width of the bands, nm.
    """
    if description.sky is None:
        return []
    lights = [({"type": "constant", "radiance": regular(description.sky, *span)}, 1.0)]
    if isinstance(description.sky, SkyDome):
        lights = [_map(part, bands_nm, step_nm) for part in description.sky.parts]
        lights += [(_far_light(disc, span), 1.0) for disc in description.sky.discs]
        if description.sky.discs:
            why = "they are rendered as directional lights: no penumbra, no image in a mirror"
            ledger.left_out("width of sun and moon", why, 1.0, "relative", key="discs")
    surfaces = coloured_surfaces(description, *span)
    return [
        (
            build_world(description, surfaces, discs=False, sky_light=light).scene,
            np.broadcast_to(factor, len(bands_nm)),
        )
        for light, factor in lights
    ]


def _map(part: Any, bands_nm: Any, step_nm: Any) -> Any:
    """Return (environment map, factor per band) of a part of the sky.

    The map is grey. Mitsuba converts grey to a spectrum that it chooses. The factor converts that
    to the spectrum of the part.
    """
    rows, columns = MAP
    up = 90 - (np.arange(rows) + 0.5) * (180 / rows)
    # after the rotation UPRIGHT, the left edge of the map is the direction -x of the world
    around = (np.arange(columns) + 0.5) * (360 / columns) - 180
    grey = pattern_at(part.pattern, sky_direction(up[:, None], around))
    light = {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.repeat(grey[..., None], 3, -1).astype(np.float32)),
        "to_world": mi.ScalarTransform4f(UPRIGHT),
    }
    flat = {**light, "bitmap": mi.Bitmap(np.ones((4, 8, 3), np.float32))}
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0, 0, -1)
    inside = (np.arange(WITHIN) + 0.5) / WITHIN - 0.5
    nm = np.asarray(bands_nm, float)[:, None] + inside * step_nm
    own = np.zeros(nm.shape)
    emitter = mi.load_dict(flat)
    for place in np.ndindex(nm.shape):
        si.wavelengths = [float(nm[place])] * 4
        own[place] = np.array(emitter.eval(si))[0]
    return light, part.spectrum.at(nm).mean(1) / own.mean(1)


def _far_light(disc: Any, span: Any) -> Any:
    """Return the sun or the moon as a light of one direction."""
    radiance = regular(disc.radiance, *span)
    return {
        "type": "directional",
        "direction": (-disc.direction()).tolist(),
        "irradiance": times(radiance, disc.solid_angle_sr()),
    }


def _lamp_scene(
    description: SceneDescription,
    view: View,
    lamps: Sequence[PlacedLamp],
    groups: Sequence[str],
    span: tuple[float, float],
) -> tuple[Any, Callable[..., Any]]:
    """Return the Mitsuba scene of all lamps, and a function that switches on one group alone and
    returns whether the group has lamps.
    """
    lights = spots([p if p.lamp.group in groups else replace(p, peak_cd_m2=0.0) for p in lamps])
    pictures = {id(s.picture): _picture(s.picture) for s in lights}  # many spots share one
    entries = {
        f"spot{k:05d}": _spot(s, lamps[s.lamp].lamp.spectrum, pictures[id(s.picture)])
        for k, s in enumerate(lights)
    }
    mirrored = [beam_lamp(p, view.origin_m, mirrored_only=True) for p in lamps]
    scene = build_world(
        description, coloured_surfaces(description, *span), mirrored.__getitem__, **entries
    ).scene
    fields = mi.traverse(scene)
    group_of = [lamps[s.lamp].lamp.group for s in lights]
    share = _shares(scene, view, lights, group_of, groups)

    def switch(group: str) -> bool:
        for k, own in enumerate(group_of):
            fields[f"spot{k:05d}.sampling_weight"] = float(share[k]) if own == group else 0.0
        fields.update()
        for placed, emitter in zip(lamps, mirrored, strict=True):
            emitter.on = placed.lamp.group == group
        return group in group_of

    return scene, switch


def _picture(values: np.ndarray) -> Any:
    """Return a picture (rows, columns) as the texture of a spot, without gamma."""
    return mi.load_dict(
        {
            "type": "bitmap",
            "bitmap": mi.Bitmap(values[..., None]),
            "raw": True,
            "wrap_mode": "clamp",
        }
    )


def _spot(spot: Spot, spectrum: Spectrum, picture: Any) -> dict[str, float | str]:
    """Return the Mitsuba dictionary of a spot.

    Parameters
    ----------
    spot : position, axes, cone and peak luminous intensity, cd.
    spectrum : spectrum of the lamp.
    picture : Mitsuba texture of the luminous intensity by direction, relative to the peak.
    """
    table = emission_table([spectrum])[0] * spot.peak_cd
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = spot.frame, spot.point
    return {
        "type": "spot",
        "cutoff_angle": spot.cutoff_deg,
        "beam_width": spot.cutoff_deg,
        "to_world": mi.ScalarTransform4f(matrix),
        "intensity": {
            "type": "regular",
            "wavelength_min": float(SPECTRUM_NM[0]),
            "wavelength_max": float(SPECTRUM_NM[-1]),
            "values": ", ".join(f"{v:.9g}" for v in table),
        },
        "texture": picture,
    }


def _shares(
    scene: Any, view: View, lights: Sequence[Spot], group_of: Sequence[str], groups: Sequence[str]
) -> np.ndarray:
    """Return the share of each spot within its group, and state the error of replacing extended
    lamps by spots.
    """
    share = np.zeros(len(lights))
    points = seen_points(scene, view)
    errors = []
    for group in groups:
        mine = [k for k, own in enumerate(group_of) if own == group]
        if mine:
            lux, distance = illuminance([lights[k] for k in mine], points)
            share[mine] = shares([lights[k] for k in mine], lux)
            errors.append(extent_error([lights[k] for k in mine], lux, distance))
    if errors:
        ledger.error(
            max(errors),
            "relative",
            "bound",
            "mean over the light; each lamp is rendered as a point source in front of it",
        )
    return share
