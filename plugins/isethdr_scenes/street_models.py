"""Models of a street: meshes of what the camera sees, at the levels of `street_detail`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from isethdr_core.scene import Model, Part, Placed

from .geometry.surroundings import tube
from .geometry.vehicles import headlamp
from .lamp_spectra import spectrum_of
from .photometry.families import family, family_of_traffic
from .placement import DRIVING
from .placing.camera import Eye
from .placing.plan import Layout, Standing
from .roads.ground.structures import luminaire_poses
from .roads.kinds import BaseRoad
from .roads.surface import surface
from .street_detail import Level, levels
from .things import build
from .things.detail import clean, coarser
from .things.packs.asset import AssetThing
from .things.thing import Thing
from .variation import AGAIN

DISTANT_CELL_M = 0.25  # width of the cells in which the level `distant` merges vertices
COARSE = ("car", "truck", "bus")  # groups with a level `distant` of their own
# things within this distance are built in all directions: their shadow or light may be visible
ALWAYS_M = 30.0
LAMPS_M = 60.0  # the same distance for things with a lamp on
MARGIN_DEG = 20.0  # width of the zone around the picture in which things are built
OWN_LAMPS = (2.25, 0.65, 0.65)  # ahead of the car's middle, to either side, above the road
CATEGORIES = {"road": "road", "land": "vegetation", "structures": "building"}
LUMINAIRE = "tunnel"
AS_BUILT = family("dipped_r112_b")  # beam of the low beams as built; `switched` replaces it
OWN_HEADLAMPS = "own headlamps"
HIDDEN = "hidden"  # the model without parts


def visible(layout: Layout, eye: Eye, field_deg: float) -> list[Standing]:
    """Return the things in the picture or near it, in the order of the layout.

    A thing farther from the axis than half the field plus a margin is left out, unless it is near
    the camera.

    Parameters
    ----------
    layout : all things on and beside the road.
    eye : place and axis of the camera.
    field_deg : full horizontal field angle, degrees.
    """
    out = []
    there = [standing for standing in layout.standing if not standing.gone]
    half = np.radians(min(field_deg / 2 + MARGIN_DEG, 180.0))
    axis = eye.direction[:2] / max(float(np.linalg.norm(eye.direction[:2])), 1e-9)
    for standing in there:
        way = standing.pose[:2, 3] - eye.position_m[:2]
        distance = float(np.linalg.norm(way))
        radius = 0.5 * float(np.hypot(*standing.foot.thing.size_m[:2])) * standing.foot.scale
        keep = distance - radius < (LAMPS_M if standing.foot.lamps else ALWAYS_M)
        angle = np.arccos(np.clip(way @ axis / max(distance, 1e-9), -1, 1))
        spread = np.arcsin(min(radius / max(distance, 1e-9), 1.0))
        if keep or angle - spread < half:
            out.append(standing)
    return out


def model_names(layout: Layout, shown: list[Standing]) -> dict[str, str]:
    """Return the name of each thing's model by the name of the thing; equal things share a name.

    The name selects the paint, the cloth and the dirt (`variation`). In a sequence it is that of
    the first moment, so that nothing changes its looks when another thing leaves the picture.

    Parameters
    ----------
    layout : all things on and beside the road at the first moment.
    shown : things that the camera may see then (`visible`).
    """
    some = {one.name for one in shown}
    keys: dict[tuple, str] = {}
    for one in sorted(layout.standing, key=lambda one: one.name not in some):
        keys.setdefault((one.foot.thing, one.foot.lamps), f"{one.foot.thing.family}{len(keys)}")
    return {one.name: keys[one.foot.thing, one.foot.lamps] for one in layout.standing}


def things_of(
    layout: Layout,
    shown: list[Standing],
    eye: Eye,
    spectra: dict[str, str],
    beam: str,
    names: Mapping[str, str] | None = None,
) -> tuple[dict[str, Model], list[Placed]]:
    """Return the models and the placed objects of things; equal things share a model.

    Objects that are not shown get a model without parts, so that every object keeps its number over
    a sequence.

    Parameters
    ----------
    layout : all things on and beside the road.
    shown : things that the camera may see (`visible`).
    eye : place of the camera, which decides the level of detail.
    spectra : name of a lamp spectrum per light group.
    beam : family of all headlamps that are on.
    names : names of the models (`model_names`); None: those of this layout.
    """
    at = levels(shown, eye.position_m)
    some = {one.name for one in shown}
    names = names or model_names(layout, shown)
    keys: dict[tuple, str] = {}
    models: dict[str, Model] = {}
    objects = []
    for one in layout.standing:
        thing = one.foot.thing
        if one.name not in some:
            models[HIDDEN] = Model(HIDDEN, ())
            objects.append(Placed(one.name, HIDDEN, thing.category, _pose_of(one)))
            continue
        own = names[one.name]
        key = (own, thing, one.foot.lamps)
        if key not in keys:
            # things that were equal at first may have other lamps on now, or another pose
            name = keys[key] = own if own not in models else f"{own}{AGAIN}{len(keys)}"
            model = _built(thing, at[thing])
            model = replace(model, name=name)
            models[name] = switched(model, one.foot.lamps, spectra, beam, layout.base.right_hand)
        objects.append(Placed(one.name, keys[key], thing.category, _pose_of(one)))
    return models, objects


def _pose_of(one: Standing) -> np.ndarray:
    """Return the pose (4, 4) of a thing with its scale."""
    pose = one.pose.copy()
    pose[:3, :3] *= one.foot.scale
    return pose


def later_poses(
    objects: list[Placed], layout: Layout, own_pose: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return the poses of objects in a later layout; the ground stays.

    Parameters
    ----------
    objects : objects with their present poses, in the order of the scene.
    layout : later layout; its things have the same names.
    own_pose : (4, 4) later pose of the camera's car.
    """
    moved = {one.name: _pose_of(one) for one in layout.standing}
    moved[OWN_HEADLAMPS] = own_pose
    return tuple(moved.get(one.name, one.pose) for one in objects)


@lru_cache(maxsize=256)  # more models than one street has, so that its next frame builds none
def _built(thing: Thing, level: Level) -> Model:
    """Return the model of a thing; scenes that follow each other share some of them."""
    if isinstance(thing, AssetThing) and thing.asset is not None:
        return thing.asset.build(level).model()
    if level != "distant":
        return build(thing, level).model()
    assembly = build(thing, "far")
    return (coarser(assembly, DISTANT_CELL_M) if thing.group in COARSE else assembly).model()


def switched(
    model: Model,
    lamps: tuple[str, ...],
    spectra: dict[str, str],
    beam: str,
    right_hand: bool = True,
) -> Model:
    """Return the model with only `lamps` on, in the spectra of their light groups.

    Parameters
    ----------
    model : model with all of its lamps.
    lamps : kinds that are on, or `kind:left` and `kind:right` of one side.
    spectra : name of a lamp spectrum by light group.
    beam : family of low beams without a table of their own; its intensity is that of low beams
        without an intensity of their own.
    right_hand : whether traffic keeps to the right; otherwise the beam is mirrored.
    """
    pattern = family_of_traffic(beam, right_hand)

    def switch(part: Part) -> Part:
        lamp = part.lamp
        if lamp is None:
            return part
        side = "left" if float(part.vertices[:, 1].mean()) > 0 else "right"
        if lamp.kind not in lamps and f"{lamp.kind}:{side}" not in lamps:
            return replace(part, lamp=None)
        # a low beam of an asset pack keeps a table or an intensity of its own
        if lamp.kind == "low_beam" and lamp.table is AS_BUILT.table:
            own = lamp.intensity_cd != AS_BUILT.intensity_cd
            candela = lamp.intensity_cd if own else pattern.intensity_cd
            lamp = replace(lamp, table=pattern.table, intensity_cd=candela)
        if lamp.group in spectra:
            lamp = replace(lamp, spectrum=spectrum_of(spectra[lamp.group]))
        return replace(part, lamp=lamp)

    return Model(model.name, tuple(switch(part) for part in model.parts))


def ground_of(base: BaseRoad, spectra: dict[str, str]) -> tuple[dict[str, Model], list[Placed]]:
    """Return road, land, bridges and tunnels, with the luminaires of the tunnels."""
    models = {}
    objects = []
    for assembly in (a for a in surface(base.network) if a.parts):
        # where a kerb sinks to zero height its last face has no area; `clean` removes it
        models[assembly.name] = clean(assembly).model()
        objects.append(Placed(assembly.name, assembly.name, CATEGORIES[assembly.name], np.eye(4)))
    poses = [pose for road in base.network.roads for pose in luminaire_poses(road)]
    if poses:
        made = tube.luminaire().model()
        models["luminaire"] = switched(made, (LUMINAIRE,), spectra, "dipped_r112_b")
        objects += [
            Placed(f"luminaire {k}", "luminaire", "street lamp", pose)
            for k, pose in enumerate(poses)
        ]
    return models, objects


def own_headlamps(
    own_pose: np.ndarray, spectra: dict[str, str], beam: str, right_hand: bool = True
) -> tuple[dict[str, Model], list[Placed]]:
    """Return the headlamps of the camera's car.

    Parameters
    ----------
    own_pose : (4, 4) pose of the camera's car.
    spectra : name of a lamp spectrum by light group.
    beam : family of the headlamps.
    right_hand : as in `switched`.
    """
    built = headlamp.own_headlamps(*OWN_LAMPS).model()
    model = switched(built, DRIVING, spectra, beam, right_hand)
    return (
        {"own_headlamps": model},
        [Placed(OWN_HEADLAMPS, "own_headlamps", "own vehicle", own_pose)],
    )


def lamp_kinds(base: BaseRoad, standing: Iterable[Standing]) -> set[str]:
    """Return the kinds of lamps that are on, without building a mesh."""
    kinds = {lamp.partition(":")[0] for one in standing for lamp in one.foot.lamps}
    kinds.add("low_beam")
    if any(luminaire_poses(road) for road in base.network.roads):
        kinds.add(LUMINAIRE)
    return kinds


def stored(models: dict[str, Model]) -> tuple[int, int]:
    """Return the number of triangles and of bytes of all models; each model is stored once."""
    triangles = size = 0
    for model in models.values():
        for part in model.parts:
            triangles += len(part.faces)
            size += part.vertices.nbytes + part.faces.nbytes
            size += 0 if part.normals is None else part.normals.nbytes
    return triangles, size
