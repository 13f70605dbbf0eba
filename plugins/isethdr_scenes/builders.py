"""Build models from recipes. A recipe is a tuple of a name and its arguments; equal recipes share
one model.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from isethdr_core.scene import Camera, Model, Placed, SceneDescription, fog_of

from .geometry.mesh import piece
from .geometry.road_users import cyclist, deer, person
from .geometry.surroundings import house, plants, road, roadside, signs, tube
from .geometry.vehicles import bus, car, car_shapes, headlamp, truck
from .lamp_spectra import spectrum_of
from .materials import used
from .photometry.families import family
from .placement import Spot, eye
from .sky.choice import sky_of_scene
from .variation import varied

if TYPE_CHECKING:
    import numpy as np

    from .geometry.mesh.piece import Assembly, Piece
    from .geometry.surroundings.ground import Ground
    from .night_drive import NightDrive
    from .tunnel import Tunnel

PLANTS = {
    "oak": lambda: plants.broadleaf("oak", 9.5, seed=1),
    "birch": lambda: plants.broadleaf("birch", 11.5, 20000, 5, "bark_pale"),
    "spruce": lambda: plants.conifer("spruce", 13.0, seed=2),
    "bush": lambda: plants.bush("bush", 1.5, seed=3),
}


def _grass(ground: Ground) -> Assembly:
    near_grass = plants.grass(
        road.tufts(ground, (2, 22), (5.0, 9.5), 70, ground.seed), "near", 0.25, ground.seed
    )
    far_grass = plants.grass(
        road.tufts(ground, (20, 75), (5.0, 12), 22, ground.seed + 1), "far", 0.30, ground.seed + 1
    )
    return piece.Assembly("grass").add(*near_grass.parts, *far_grass.parts)


def _deer(antlers: bool, head_up: float) -> Assembly:
    return deer.deer(
        height=0.98 if antlers else 0.86,
        antlers=antlers,
        head_up=head_up,
        turn=0.5 if antlers else 0.0,
    )


RECIPES = {
    "car": lambda shape, paint, step=0.055: car.build(
        replace(car_shapes.CARS[shape], paint=paint, step=step)
    ),
    "truck": truck.truck,
    "bus": bus.bus,
    "person": lambda look, phase: person.pedestrian(person.LOOKS[look], phase, seed=look),
    "bicycle": lambda: cyclist.bicycle()[0],
    "rider": lambda: cyclist.rider(),
    "deer": _deer,
    "plant": lambda kind: PLANTS[kind](),
    "road": road.road,
    "field": road.field,
    "grass": _grass,
    "guard_rail": roadside.guard_rail,
    "own_headlamps": headlamp.own_headlamps,
    "house": house.house,
    "street_lamp": roadside.street_lamp,
    "marker_post": roadside.marker_post,
    "sign": signs.sign,
    "shrub": lambda: plants.bush("shrub", 1.0, 2500, 4),
    "tunnel": tube.tunnel,
    "luminaire": tube.luminaire,
}
IN_PLACE = ("road", "field", "grass", "guard_rail", "tunnel")  # built in world coordinates


def describe(
    name: str,
    scene: NightDrive | Tunnel,
    ground: Ground,
    spots: list[Spot],
    target: np.ndarray,
    light: dict[str, str],
) -> SceneDescription:
    """Return the description of a `scene` (a component with the fields of camera, sky and road
    surface) whose camera looks at `target`.

    Parameters
    ----------
    name : name of the scene.
    scene : component with the fields of camera, sky, fog, headlamps, road surface and seed.
    ground : road surface, on which spots and camera stand.
    spots : objects to place.
    target : (3,) point at which the camera looks, m.
    light : name of a lamp spectrum by light group.
    """
    models, objects = place(spots, ground, light, scene.headlamp_beam)
    materials_used = used(models, scene.road_surface, scene.seed)
    models, materials = varied(models, materials_used, scene.seed)
    position = eye(ground, scene.camera_height_m)
    camera = Camera(
        tuple(position.tolist()),
        tuple(target.tolist()),
        scene.horizontal_field_deg,
        scene.aspect,
        scene.projection,
    )
    return SceneDescription(
        name,
        models,
        objects,
        materials,
        camera,
        sky_of_scene(scene),
        fog=fog_of(scene.visibility_m),
    )


def place(
    spots: list[Spot], ground: Ground, spectra: dict[str, str], beam: str = "dipped_r112_b"
) -> tuple[dict[str, Model], tuple[Placed, ...]]:
    """Return the models and the placed objects of `spots`.

    Parameters
    ----------
    spots : objects to place; those with equal recipes and lamps share a model.
    ground : road surface, on which they stand.
    spectra : name of a lamp spectrum by light group.
    beam : family of the beam of all headlamps that are on.
    """
    names = {}
    models = {}
    objects = []
    for spot in spots:
        key = (spot.recipe, spot.lamps)
        if key not in names:
            names[key] = f"{spot.recipe[0]}{len(names)}"
            # models in world coordinates fit one scene only, so the cache is bypassed
            built = _built if spot.recipe[0] not in IN_PLACE else _built.__wrapped__
            model = _switched(replace(built(spot.recipe), name=names[key]), spot.lamps, spectra)
            models[names[key]] = _with_beam(model, beam)
        pose = ground.place(spot.s_m, spot.y_m, spot.turn_deg, spot.z_m) @ piece.pose(
            scale=(spot.scale,) * 3
        )
        objects.append(
            Placed(
                spot.name,
                names[key],
                spot.category,
                piece.pose() if spot.recipe[0] in IN_PLACE else pose,
            )
        )
    return models, tuple(objects)


@lru_cache(maxsize=24)
def _built(recipe: tuple) -> Model:
    """Return the model of a recipe, cached: a night drive has about twenty recipes, and shares half
    of them with the next one.
    """
    return RECIPES[recipe[0]](*recipe[1:]).model()


def _switched(model: Model, lamps: tuple[str, ...], spectra: dict[str, str]) -> Model:
    """Return the model with only the lamp kinds in `lamps` on; `spectra` sets their spectra by
    light group.
    """

    def switch(part: Piece) -> Piece:
        lamp = part.lamp
        if lamp is None or lamp.kind not in lamps:
            return replace(part, lamp=None) if lamp else part
        return (
            replace(part, lamp=replace(lamp, spectrum=spectrum_of(spectra[lamp.group])))
            if lamp.group in spectra
            else part
        )

    return Model(model.name, tuple(switch(p) for p in model.parts))


def _with_beam(model: Model, beam: str) -> Model:
    """Return the model with headlamps of the family `beam`; models are built with dipped beams of
    class B.
    """
    if beam == "dipped_r112_b":
        return model
    pattern = family(beam)

    def fit(part: Piece) -> Piece:
        if part.lamp is None or part.lamp.kind != "low_beam":
            return part
        lamp = replace(part.lamp, table=pattern.table, intensity_cd=pattern.intensity_cd)
        return replace(part, lamp=lamp)

    return Model(model.name, tuple(fit(p) for p in model.parts))
