"""Light groups in one pass against one pass per group: CPU seconds to an equal median error.

The baseline is the most direct way with Mitsuba alone: its own `path` integrator with a `specfilm`
of 31 top-hat bands, once for each of the four groups with the other lamps black. Both run in this
process, on the same scene (the tests' street of 50 boxes), warm. The judge is neither: a long
rendering by Mitsuba's own `path`, with films of four bands, which have no colour noise, and with
other random numbers. It is made in two halves; what these differ by is the judge's own error, which
is taken off both (errors add in squares). Cost to equal error is CPU seconds x error^2. Run:

    python benchmarks/render_light_groups.py
"""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np

WIDTH = 128
HEIGHT = 72
SAMPLES = {"ours": 64, "baseline": 64}  # paths per tile
HALF = 448  # of the reference, paths per tile


def tests_scenes():
    """Return the module of the tests' scenes."""
    where = Path(__file__).parents[1] / "tests" / "mitsuba" / "conftest.py"
    spec = importlib.util.spec_from_file_location("street_scene", where)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant
    from isethdr_mitsuba.renderer import MitsubaRenderer

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.frame import even_passes, follower
    from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    make = tests_scenes()
    scene = make.street(50)
    settings = MitsubaRenderer(width=WIDTH, height=HEIGHT, margin=0.0)
    groups = list(scene.light_groups())
    bands = settings._bands(None)
    view = view_of(scene.camera, WIDTH, HEIGHT, 0.0)
    lamps = placed_lamps(scene)
    surfaces = ramp_surfaces(scene)
    one_pass = even_passes(
        follower(
            scene, view, lamps, groups, bands, settings, build_world(scene, surfaces), surfaces
        )
    )

    def ours(seed, samples):
        out = np.zeros((len(groups), len(bands), *view.shape))
        for g, band, values in one_pass(seed, samples):
            out[g, band] = np.reshape(values, view.shape)
        return out

    own = lambda films: [
        make.mitsubas_own(scene, settings, view, lamps, g, bands, films) for g in groups
    ]
    judges = own(4)
    straight = own(len(bands))
    baseline = lambda seed, samples: np.stack([render(seed, samples) for render in straight])
    started = time.process_time()
    halves = [np.stack([render(seed, HALF) for render in judges]) for seed in (1001, 1002)]
    reference = (halves[0] + halves[1]) / 2
    judge = [median_error(h, reference[g], halves[1][g]) / 2 for g, h in enumerate(halves[0])]
    print(
        f"{WIDTH}x{HEIGHT}, {len(bands)} bands, groups {', '.join(groups)}; median relative error"
        " per tile and band"
    )
    print(
        f"{'reference by path, 2 x ' + str(HALF) + ' paths':40s}"
        f" {time.process_time() - started:7.2f} CPU-s   "
        + "  ".join(f"{g} {e:.4f}" for g, e in zip(groups, judge, strict=True))
    )
    costs = {}
    for name, render, samples in (
        ("one pass, all groups (ours)", ours, SAMPLES["ours"]),
        ("four pruned passes of path + specfilm", baseline, SAMPLES["baseline"]),
    ):
        render(1, samples)  # compile
        start = time.process_time()
        picture = render(2, samples)
        seconds = time.process_time() - start
        luminance = np.array(
            [median_error(picture[g], reference[g], reference[g]) for g in range(len(groups))]
        )
        squares = np.maximum(luminance**2 - np.square(judge), 0)
        costs[name] = seconds * squares
        print(
            f"{name:40s} {seconds:7.2f} CPU-s   "
            + "  ".join(
                f"{g} {np.sqrt(e):.4f} (seen {s:.4f})"
                for g, e, s in zip(groups, squares, luminance, strict=True)
            )
        )
    ratio = np.divide(*reversed(list(costs.values())))
    print(
        "CPU seconds to equal error, baseline / ours: "
        + "  ".join(f"{g} {r:.1f}" for g, r in zip(groups, ratio, strict=True))
        + f"   geometric mean {np.exp(np.log(ratio).mean()):.1f}"
    )


def median_error(picture, reference, against):
    """Return the median over tiles and bands of |picture - against| / reference, on tiles above 1 %
    of the group's mean.
    """
    lit = reference.mean(0) > 0.01 * reference.mean()
    picture = picture[:, lit]
    reference = reference[:, lit]
    against = against[:, lit]
    there = reference > 1e-3 * reference.mean(0)  # a lamp may have no light in some bands
    return float(np.median(np.abs(picture - against)[there] / reference[there]))


if __name__ == "__main__":
    sys.exit(main())
