"""Light groups in one pass against one pass per group: CPU seconds to an equal median error.

The baseline is the most direct way with Mitsuba alone: its own `path` integrator with a `specfilm` of 31 top-hat
bands, once for each of the four groups with the other lamps black. Both run in this process, on the same scene
(the tests' street of 50 boxes), warm, and against one reference made by our integrator with many more
paths, so that neither is judged by itself. Cost to equal error is CPU seconds x error^2. Run:

    python benchmarks/render_light_groups.py
"""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, SAMPLES, REFERENCE_SAMPLES = 256, 144, 64, 768


def street():
    """Return the tests' street, with 50 boxes."""
    where = Path(__file__).parents[1] / "tests" / "mitsuba" / "conftest.py"
    spec = importlib.util.spec_from_file_location("street_scene", where)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.street(50)


def main():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant
    from isethdr_mitsuba.renderer import MitsubaRenderer

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.beam_lamp import beam_lamp, film, sensor
    from isethdr_mitsuba.frame import path_pass
    from isethdr_mitsuba.geometry import build_world
    from isethdr_mitsuba.materials import coloured_surfaces, ramp_surfaces, regular
    from isethdr_mitsuba.placed_lamps import placed_lamps
    from isethdr_mitsuba.view import view_of

    scene, settings = street(), MitsubaRenderer(width=WIDTH, height=HEIGHT, margin=0.0)
    groups, bands = list(scene.light_groups()), settings._bands(None)
    view, lamps, surfaces = view_of(scene.camera, WIDTH, HEIGHT, 0.0), placed_lamps(scene), ramp_surfaces(scene)
    one_pass = path_pass(scene, view, lamps, groups, bands, settings, build_world(scene, surfaces), surfaces)

    def ours(seed, samples):
        out = np.zeros((len(groups), len(bands), *view.shape))
        for g, band, values in one_pass(seed, samples):
            out[g, band] = np.reshape(values, view.shape)
        return out

    colours = coloured_surfaces(scene, 390.0, 710.0)
    camera = mi.load_dict(sensor(view, film(bands, settings.step_nm, WIDTH, HEIGHT)))
    integrator = mi.load_dict({"type": "path", "max_depth": settings.max_depth, "rr_depth": 1000})
    worlds = []
    for group in groups:
        sky = {"light": {"type": "constant", "radiance": regular(scene.sky, 390.0, 710.0)}} if group == "sky" else {}
        worlds.append(build_world(scene, colours, lambda k, g=group: beam_lamp(lamps[k], view.origin_m) if lamps[k].lamp.group == g else None, **sky))

    def baseline(seed, samples):
        return np.stack([np.moveaxis(np.array(mi.render(w.scene, sensor=camera, integrator=integrator, spp=samples, seed=seed)), -1, 0)
                         for w in worlds]) / settings.step_nm

    reference = np.mean([ours(1000 + k, REFERENCE_SAMPLES // 4) for k in range(4)], 0)
    print(f"{WIDTH}x{HEIGHT}, {len(bands)} bands, groups {', '.join(groups)}; median relative error per tile and band")
    costs = {}
    for name, render in (("one pass, all groups (ours)", ours), ("four pruned passes of path + specfilm", baseline)):
        render(1, SAMPLES)                                  # compile
        start = time.process_time()
        picture = render(2, SAMPLES)
        seconds = time.process_time() - start
        errors = [median_error(picture[g], reference[g]) for g in range(len(groups))]
        costs[name] = seconds * np.square(errors)
        print(f"{name:40s} {seconds:7.2f} CPU-s   " + "  ".join(f"{g} {e:.4f}" for g, e in zip(groups, errors, strict=True)))
    ratio = np.divide(*reversed(list(costs.values())))
    print("CPU seconds to equal error, baseline / ours: " + "  ".join(f"{g} {r:.1f}" for g, r in zip(groups, ratio, strict=True))
          + f"   geometric mean {np.exp(np.log(ratio).mean()):.1f}")


def median_error(picture, reference):
    """Return the median over tiles and bands of |relative error|, on tiles above 1 % of the group's mean."""
    lit = reference.mean(0) > 0.01 * reference.mean()
    picture, reference = picture[:, lit], reference[:, lit]
    there = reference > 1e-3 * reference.mean(0)             # a lamp may have no light in some bands
    return float(np.median(np.abs(picture[there] / reference[there] - 1)))


if __name__ == "__main__":
    sys.exit(main())
