"""Fog as rendered by Mitsuba's own volumetric path integrator, `volpath`: a reference."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.lamps.beam_lamp import beam_lamp, film, sensor
from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
from isethdr_mitsuba.world.geometry import build_world
from isethdr_mitsuba.world.materials import coloured_surfaces, regular
from isethdr_mitsuba.world.view import View

from isethdr_core.extras import needed
from isethdr_core.scene import Fog, SceneDescription

with needed("a reference of fog", extra="mitsuba"):
    import mitsuba as mi

FAR_M = 3000.0  # half width of the box that holds the fog, m

Pictures = Callable[[int, int], npt.NDArray[np.float64]]


def volpath_pictures(
    scene: SceneDescription, view: View, group: str, max_depth: int, top_m: float = FAR_M
) -> Pictures:
    """Return a function of seed and samples per tile. It returns the radiance (y, x) of one light
    group at 550 nm, without directly visible lamps.

    Parameters
    ----------
    scene : scene with fog.
    view : view of the camera.
    group : light group.
    max_depth : largest number of segments of a path; scattering in fog and on surfaces both count;
        -1: no limit.
    top_m : height of the upper end of the fog, above which the sky begins, m.
    """
    assert scene.fog is not None
    span = 535.0, 575.0
    lamps = placed_lamps(scene, "intensity")
    emitter_of = lambda k: (
        beam_lamp(lamps[k], view.origin_m) if lamps[k].lamp.group == group else None
    )
    medium = medium_of(scene.fog)
    size = mi.ScalarTransform4f().translate([0, 0, top_m - FAR_M]).scale(FAR_M)
    extra: dict[str, Any] = {
        "fog": {
            "type": "cube",
            "to_world": size,
            "bsdf": {"type": "null"},
            "interior": medium,
        }
    }
    if group == "sky":
        extra["light"] = {"type": "constant", "radiance": regular(scene.sky, *span)}
    world = build_world(scene, coloured_surfaces(scene, *span), emitter_of, **extra)
    integrator = mi.load_dict({"type": "volpath", "max_depth": max_depth, "rr_depth": 1000})
    bands = np.array([540.0, 550.0, 560.0, 570.0])
    camera = sensor(view, film(bands, 10.0, view.shape[1], view.shape[0]))
    camera = mi.load_dict(camera | {"sampler": {"type": "independent"}, "medium": medium})

    def pictures(seed: int, samples: int) -> npt.NDArray[np.float64]:
        found = mi.render(world.scene, sensor=camera, integrator=integrator, spp=samples, seed=seed)
        return np.asarray(found, float)[..., 1] / 10.0

    return pictures


def medium_of(fog: Fog) -> Any:
    """Return Mitsuba's homogeneous medium for a grey fog."""
    phase: dict[str, Any] = {"type": "hg", "g": fog.lobes[0].asymmetry}
    below = fog.lobes[0].share
    for lobe in fog.lobes[1:]:
        below += lobe.share
        other = {"type": "hg", "g": lobe.asymmetry}
        phase = {"type": "blendphase", "weight": lobe.share / below, "a": phase, "b": other}
    return mi.load_dict(
        {
            "type": "homogeneous",
            "sigma_t": fog.extinction_per_m,
            "albedo": fog.albedo,
            "phase": phase,
        }
    )
