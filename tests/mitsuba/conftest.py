"""Small scenes with known light, for the renderer's tests."""

from types import SimpleNamespace

import numpy as np
import pytest

from isethdr_core.scene import (
    Camera,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    SceneDescription,
    Spectrum,
    flat,
)

CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
CUBE_FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
)


def quad(half_y, half_z, x=0.0):
    """Return a rectangle in the plane x = const that faces +x."""
    v = np.array(
        [[x, -half_y, -half_z], [x, half_y, -half_z], [x, half_y, half_z], [x, -half_y, half_z]],
        float,
    )
    return v, np.array([[0, 1, 2], [0, 2, 3]])


def part(mesh, material="grey", lamp=None, name="part"):
    return Part(name, np.asarray(mesh[0], float), np.asarray(mesh[1]), material, None, lamp)


def pose(x=0.0, y=0.0, z=0.0, turn_deg=0.0, scale=1.0, pitch_deg=0.0):
    """Return a pose: scale, rotation by pitch about y, then rotation about z, then a shift."""
    a, b = np.radians([turn_deg, pitch_deg])
    out = np.eye(4)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    tip = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    out[:3, :3] = turn @ tip * scale
    out[:3, 3] = x, y, z
    return out


def describe(parts_at, camera=None, sky=None, materials=()):
    """Return a scene description with one model for each entry of `parts_at`.

    Each entry is (name, category, tuple of parts, pose).
    """
    models = {name: Model(name, tuple(parts)) for name, _, parts, _ in parts_at}
    objects = tuple(Placed(name, name, category, p) for name, category, _, p in parts_at)
    known = {
        "grey": Material("grey", reflectance=flat(0.5)),
        "black": Material("black", reflectance=flat(0.0)),
        **{m.name: m for m in materials},
    }
    return SceneDescription(
        "test", models, objects, known, camera or Camera((0, 0, 0), (1, 0, 0), 40.0, 1.0), sky
    )


def street(boxes=12, seed=3):
    """Return a street at night: ground, boxes, two street lamps, head lamps and tail lamps of cars,
    and a dim sky.
    """
    nm = np.arange(360.0, 831.0, 5)
    bell = lambda c, s: np.exp(-0.5 * ((nm - c) / s) ** 2)
    table = lambda v: Spectrum(tuple(nm), tuple(v))
    rng = np.random.default_rng(seed)
    materials = [
        Material(
            f"m{i}",
            kind,
            table(
                np.clip(
                    0.05
                    + 0.4 * rng.random() * bell(rng.uniform(420, 680), 60)
                    + 0.2 * rng.random(),
                    0,
                    0.9,
                )
            ),
            0.2,
        )
        for i, kind in enumerate(
            ("diffuse", "plastic", "conductor", "diffuse", "diffuse", "plastic")
        )
    ]
    led = table(bell(452, 11) + 0.75 * bell(560, 55))
    sodium = table(bell(589, 10) + 0.02)
    red = table(bell(630, 12) + 1e-3)
    down = Lamp("street", "streetlights", 3000.0, sodium, (0, 0, -1.0), 60.0, 80.0, 0.01)
    head = Lamp("low_beam", "headlights", 2e4, led, (-1.0, 0, -0.02), 8.0, 25.0, 0.01)
    tail = Lamp("tail", "other", 5.0, red, (-1.0, 0, 0), 90.0, 90.0, 0.0)
    back = lambda *a: (quad(*a)[0] * [-1, 1, 1], quad(*a)[1][:, ::-1])
    lying = (quad(0.4, 0.2)[0][:, [2, 1, 0]], quad(0.4, 0.2)[1])  # faces -z
    out = [
        ("ground", "road", (part((quad(60, 60)[0][:, [2, 1, 0]], quad(60, 60)[1]), "m0"),), pose())
    ]
    for i in range(boxes):
        x = rng.uniform(6, 45)
        y = rng.uniform(-14, 14)
        y += 4 * np.sign(y) if abs(y) < 3 else 0
        s = rng.uniform(0.3, 1.2)
        out.append(
            (
                f"box{i}",
                "building",
                (part((CUBE, CUBE_FACES), f"m{i % 6}"),),
                pose(x, y, s, rng.uniform(0, 90), s),
            )
        )
    for i in range(2):
        out.append(
            (
                f"street{i}",
                "street lamp",
                (part(lying, "black", down),),
                pose(10 + 12 * i, 5 * (-1) ** i, 7),
            )
        )
    for i, y in enumerate((1.3, 2.5)):
        out.append((f"head{i}", "car", (part(back(0.09, 0.07), "black", head),), pose(22, y, 0.7)))
    for i, y in enumerate((-2.5, -1.3)):
        out.append((f"tail{i}", "car", (part(back(0.1, 0.06), "black", tail),), pose(16, y, 0.8)))
    return describe(
        out,
        Camera((0, 0, 1.4), (18, 0, 1.2), 50.0, 16 / 9),
        table(1e-7 * (0.6 + 0.4 * bell(450, 80))),
        materials,
    )


def mitsubas_own(  # noqa: PLR0913 - a helper of tests
    scene, settings, view, lamps, group, bands_nm, sampler="independent"
):
    """Return an independent renderer of one light group, made of Mitsuba's own parts.

    It uses Mitsuba's `path` and `specfilm`, the emitter plugin for lamps, and only the lamps of the
    group. The result is a function of seed and samples that returns pictures (band, y, x) without
    lamps seen directly. A film has four bands, so that the choice of wavelengths adds no noise.
    """
    import mitsuba as mi
    from isethdr_mitsuba.lamps.beam_lamp import beam_lamp, film, sensor
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import coloured_surfaces, regular

    span = bands_nm[0] - settings.step_nm / 2, bands_nm[-1] + settings.step_nm / 2
    sky = (
        {"light": {"type": "constant", "radiance": regular(scene.sky, *span)}}
        if group == "sky"
        else {}
    )
    emitter_of = lambda k: (
        beam_lamp(lamps[k], view.origin_m) if lamps[k].lamp.group == group else None
    )
    world = build_world(scene, coloured_surfaces(scene, *span), emitter_of, **sky)
    integrator = mi.load_dict({"type": "path", "max_depth": settings.max_depth, "rr_depth": 1000})
    films = []
    for k in range(0, len(bands_nm), 4):
        some = bands_nm[k : k + 4]
        # add bands, so that all films have four
        some = np.r_[some, some[-1] + settings.step_nm * np.arange(1, 4 - len(some) + 1)]
        camera = sensor(view, film(some, settings.step_nm, view.shape[1], view.shape[0]))
        films.append(mi.load_dict(camera | {"sampler": {"type": sampler}}))

    def pictures(seed, samples):
        found = [
            np.array(
                mi.render(world.scene, sensor=f, integrator=integrator, spp=samples, seed=seed)
            )
            for f in films
        ]
        return (
            np.moveaxis(np.concatenate(found, -1)[..., : len(bands_nm)], -1, 0) / settings.step_nm
        )

    return pictures


@pytest.fixture(scope="session")
def make():
    """Return the builders above in one namespace."""
    return SimpleNamespace(
        quad=quad,
        part=part,
        pose=pose,
        describe=describe,
        street=street,
        mitsubas_own=mitsubas_own,
        cube=(CUBE, CUBE_FACES),
        lamp=Lamp,
        camera=Camera,
        material=Material,
        flat=flat,
        spectrum=Spectrum,
    )
