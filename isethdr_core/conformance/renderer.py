"""Promises of a renderer: the requested data, a uniform sky, lamps of the stated candela, and light
linear in the lamps.

Pass fields that make the renderer quick, for example `check("renderer", "mitsuba", width=32,
height=18, samples=16)`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from ..data.quantities import LABELS, check_scene, tile_pitch
from ..data.scene_description import (
    Camera,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    SceneDescription,
    flat,
)
from ..physics.photometry import luminance
from ..pipeline.demand import Demand
from ..plugins.protocols import Renderer
from ..runs.radiance_cache.rendered_radiance import checked
from ..runs.sample_accumulation import rendered_anew
from .promise import close, holds, keeps, refuses, same, stated

SKY = 0.02  # W m-2 sr-1 nm-1
INTENSITY_CD = 1000.0
DISTANCE_M = 10.0


def check(subject: str, renderer: Renderer) -> None:
    """Check one renderer on three tiny worlds: a sky alone, a lamp alone, and a road with both."""
    _check_empty_world(subject, renderer)
    _check_lamp(subject, renderer)
    everything = Demand(labels=frozenset(LABELS))
    with keeps(subject, "renders a road, a lamp and a sky"):
        full_scene = stated(subject, lambda: rendered_anew(renderer, world(), everything))
        checked(full_scene, subject)
    _check_demanded(subject, renderer, full_scene)
    same(
        subject,
        "the same call twice gives the same bits",
        full_scene,
        rendered_anew(renderer, world(), everything),
    )
    _check_labels(subject, full_scene)
    refuses(
        subject,
        "a demand for groups the scene does not have",
        lambda: rendered_anew(renderer, world(), Demand(groups=("no such group",))),
    )
    for fault, intensity_cd in (
        ("a lamp of NaN candela", np.nan),
        ("a lamp of negative candela", -1.0),
    ):
        refuses(
            subject,
            fault,
            partial(rendered_anew, renderer, world(intensity_cd=intensity_cd), Demand()),
        )


def world(
    road: bool = True, lamp: bool = True, sky: bool = True, intensity_cd: float = INTENSITY_CD
) -> SceneDescription:
    """Return a flat road, a Lambertian panel lamp that faces the camera on its axis, and a uniform
    sky.

    Parameters
    ----------
    road : whether there is a road, 100 m x 100 m, of 30 % reflectance.
    lamp : whether there is a lamp.
    sky : whether there is a sky.
    intensity_cd : luminous intensity of the lamp along its axis, cd.
    """
    corners = np.array([[0.0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    panel = Part(
        "panel",
        0.25 * corners,
        faces,
        "grey",
        lamp=Lamp("low_beam", "headlights", intensity_cd, flat(1.0)),
    )
    ground = Part(
        "ground",
        np.array([[-50.0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]]),
        faces,
        "grey",
    )
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])  # about z: the panel's +x looks back at the camera
    turned[:3, 3] = DISTANCE_M, 0.0, 1.5
    models = {"panel": Model("panel", (panel,)), "ground": Model("ground", (ground,))}
    objects = [Placed("road", "ground", "road", np.eye(4))] if road else []
    objects += [Placed("lamp", "panel", "car", turned)] if lamp else []
    return SceneDescription(
        "kit",
        {o.model: models[o.model] for o in objects},
        tuple(objects),
        {"grey": Material("grey", reflectance=flat(0.3))},
        Camera((0.0, 0.0, 1.5), (10.0, 0.0, 1.5), horizontal_field_deg=30.0, aspect=1.5),
        flat(SKY) if sky else None,
    )


def _check_empty_world(subject: str, renderer: Renderer) -> None:
    with keeps(subject, "renders a world of nothing but sky"):
        sky = rendered_anew(renderer, world(road=False, lamp=False), Demand())
        check_scene(sky)
    # 1e-3: a directly visible sky has no path noise, only the rounding of sums
    close(
        subject,
        "a uniform sky has the stated radiance everywhere",
        sky["radiance"].sel(light_group="sky").values,
        SKY,
        1e-3,
    )


def _check_lamp(subject: str, renderer: Renderer) -> None:
    with keeps(subject, "renders a lamp without a sky"):
        lamp = rendered_anew(renderer, world(road=False, sky=False), Demand())
        check_scene(lamp)
    lux = float(
        np.sum(
            luminance(lamp["radiance"].sel(light_group="headlights").values, lamp.wavelength.values)
            * _cos_solid_angle(lamp)
        )
    )
    # 3 %: the lamp's border crosses few tiles, which have few samples; a coarse grid of bands
    # distorts V(lambda)
    close(
        subject,
        "a lamp of I cd at d m on the axis gives I / d^2 lux",
        lux,
        INTENSITY_CD / DISTANCE_M**2,
        0.03,
    )
    double = rendered_anew(
        renderer, world(road=False, sky=False, intensity_cd=2 * INTENSITY_CD), Demand()
    )
    # 1e-3: the same paths carry twice the light
    close(
        subject,
        "twice the candela gives twice the light",
        double["radiance"].sum(),
        2 * lamp["radiance"].sum(),
        1e-3,
    )


def _cos_solid_angle(ds: xr.Dataset) -> np.ndarray:
    """Return the factor from radiance to irradiance on the image plane, sr: tile area times cos^4
    of the field angle.
    """
    tangent_squared = ds.x.values[None, :] ** 2 + ds.y.values[:, None] ** 2
    tile_sr: np.ndarray = tile_pitch(ds, "x") * tile_pitch(ds, "y") * (1 + tangent_squared) ** -2.0
    return tile_sr


def _check_demanded(subject: str, renderer: Renderer, full_scene: xr.Dataset) -> None:
    holds(
        subject,
        "all light groups come where all are asked for",
        set(map(str, full_scene.light_group.values)) == {"sky", "headlights"},
    )
    holds(
        subject,
        "all labels come that are asked for",
        set(LABELS) <= set(full_scene.data_vars),
        str(set(LABELS) - set(full_scene.data_vars)),
    )
    sky_only = rendered_anew(renderer, world(), Demand(groups=("sky",)))
    holds(
        subject,
        "no other light group comes than those asked for",
        [str(g) for g in sky_only.light_group.values] == ["sky"],
    )
    holds(
        subject,
        "no label comes that was not asked for",
        not set(LABELS) & set(sky_only.data_vars),
        str(set(LABELS) & set(sky_only.data_vars)),
    )
    middle = (float(full_scene.wavelength[len(full_scene.wavelength) // 2]),)
    few = rendered_anew(renderer, world(), replace(Demand(), wavelength_nm=middle))
    holds(subject, "the bands asked for come", set(middle) <= set(few.wavelength.values.tolist()))
    picked = full_scene["radiance"].sel(wavelength=middle[0])
    # 5 %: for another demand a renderer may trace other random paths
    close(
        subject,
        "a band looks the same whatever else is asked for",
        few["radiance"].sel(wavelength=middle[0]).mean(),
        picked.mean(),
        0.05,
    )
    # 5 %: again other random paths; they hardly change the mean over the frame
    close(
        subject,
        "a group looks the same whatever else is asked for",
        sky_only["radiance"].mean(),
        full_scene["radiance"].sel(light_group="sky").mean(),
        0.05,
    )


def _check_labels(subject: str, full_scene: xr.Dataset) -> None:
    half_width = np.tan(np.radians(15.0))
    half_height = np.tan(np.radians(15.0)) / 1.5
    close(
        subject,
        "field_width and field_height are the camera's field in tangents",
        [full_scene.attrs["field_width"], full_scene.attrs["field_height"]],
        [2 * half_width, 2 * half_height],
        1e-6,
    )
    top = full_scene.isel(y=0)
    bottom = full_scene.isel(y=-1)
    holds(
        subject,
        "sky has instance 0 and infinite distance",
        not top["instance"].values.any() and np.isinf(top["distance"].values).all(),
    )
    holds(
        subject,
        "objects are labelled 1, 2, ... in their order: the road is 1",
        np.all(bottom["instance"].values == 1),
    )
    # depth at which a camera 1.5 m above a flat road sees the road in this row; y points down
    depth = 1.5 / full_scene.y.values[-1]
    # 1e-3: rays are traced in float32
    close(subject, "depth is measured along the optical axis", bottom["depth"].values, depth, 1e-3)
    close(
        subject,
        "distance is measured along the ray",
        bottom["distance"].values,
        depth * np.sqrt(1 + full_scene.x.values**2 + full_scene.y.values[-1] ** 2),
        1e-3,
    )
    holds(
        subject,
        "the object table lists the road and the lamp",
        {o["name"] for o in full_scene.attrs.get("objects", [])} == {"road", "lamp"},
        str([o.get("name") for o in full_scene.attrs.get("objects", [])]),
    )
