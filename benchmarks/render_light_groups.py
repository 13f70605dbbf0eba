"""All light groups in one pass against Mitsuba's own `path`: CPU seconds to an equal error.

The opponent is the best known use of Mitsuba alone: its integrator `path`, once for each of the
four groups with the other lamps black, with eight films of four bands each. Four bands of equal
width get one wavelength each from every path, so there is no colour noise. Its sample points are
stratified (`multijitter`), as in isethdr. Both run in this process on the same scene (the tests'
street of 50 boxes), with kernels already compiled, and with the same number of paths per tile.

The error of a rendering is the median over tiles and bands of the difference between two renderings
with different random numbers, divided by the square root of 2 and by the mean of all renderings.
Tiles above 1 % of the group's mean count. The cost to equal error is CPU seconds x error^2. Run:

    python benchmarks/render_light_groups.py
"""

from __future__ import annotations

import importlib.util
import itertools
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mitsuba as mi
import numpy as np
from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.renderer import MitsubaRenderer

WIDTH = 256
HEIGHT = 144
SAMPLES = 64  # paths per tile of a rendering
REPEATS = 3  # renderings by each method; the first one compiles, and its time does not count
BLOCK = 16  # side of the blocks of tiles whose sums are compared


class Way(NamedTuple):
    """Renderings by one method: radiance (repeat, group, band, y, x), and CPU s of one of them."""

    radiance: np.ndarray
    seconds: float


def tests_scenes():
    """Return the module of the tests' scenes."""
    where = Path(__file__).parents[1] / "tests" / "mitsuba" / "conftest.py"
    spec = importlib.util.spec_from_file_location("street_scene", where)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def ways(make, scene, settings):
    """Return the functions (seed) -> radiance (group, band, y, x) of isethdr and of `path`."""
    from isethdr_mitsuba.frame import Built, Cube, follower
    from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    groups = list(scene.light_groups())
    bands = np.array(settings.bands_nm())
    view = view_of(scene.camera, settings.width, settings.height, 0.0)
    lamps = placed_lamps(scene)
    surfaces = ramp_surfaces(scene)
    world = build_world(scene, surfaces)
    cube = Cube(groups, bands, view)
    paths = follower(scene, Built(world, surfaces), lamps, cube, settings)
    opponents = [
        make.mitsubas_own(scene, settings, view, lamps, group, bands, "multijitter")
        for group in groups
    ]

    def ours(seed):
        sums = paths.even_pass(seed, SAMPLES)[:, : len(bands)]
        return sums.reshape(len(groups), len(bands), *view.shape) / SAMPLES

    def opponent(seed):
        return np.stack([render(seed, SAMPLES) for render in opponents])

    return ours, opponent


def rendered(render: Callable[[int], np.ndarray]) -> Way:
    """Return the renderings by one method, with the CPU s of one of them after compilation."""
    first = render(1)
    start = time.process_time()
    others = [render(seed) for seed in range(2, 1 + REPEATS)]
    seconds = (time.process_time() - start) / len(others)
    return Way(np.stack([first, *others]), seconds)


def median_error(renderings: np.ndarray, reference: np.ndarray) -> float:
    """Return the relative error of one of `renderings` (repeat, band, y, x) of a light group."""
    lit = reference.mean(0) > 0.01 * reference.mean()
    # a lamp may have no light in some bands
    there = lit & (reference > 1e-3 * reference.mean(0))
    pairs = [
        np.median(np.abs(a - b)[there] / reference[there])
        for a, b in itertools.combinations(renderings, 2)
    ]
    return float(np.mean(pairs) / np.sqrt(2))


def agreement(ours: np.ndarray, path: np.ndarray) -> tuple[float, float]:
    """Return the ratio of the light of both methods, and its standard error from repeats.

    `ours` and `path` are (repeat, band, y, x) of a light group. Each block of tiles has the same
    weight, so that a few bright tiles next to a lamp do not decide.
    """
    rows, columns = (n // BLOCK for n in ours.shape[-2:])
    blocks = lambda light: (
        light.sum(1)[:, : rows * BLOCK, : columns * BLOCK]
        .reshape(len(light), rows, BLOCK, columns, BLOCK)
        .sum((2, 4))
    )
    both = blocks(ours), blocks(path)
    mean = np.concatenate(both).mean(0)
    lit = mean > 0.01 * mean.mean()
    levels = [(light[:, lit] / mean[lit]).mean(1) for light in both]
    ratio = levels[0].mean() / levels[1].mean()
    return ratio, float(np.hypot(*(v.std(ddof=1) / np.sqrt(len(v)) for v in levels)))


def main() -> None:
    """Print a row for each light group, and the geometric mean."""
    mi.set_variant(choose_variant("llvm"))
    make = tests_scenes()
    scene = make.street(50)
    settings = MitsubaRenderer(width=WIDTH, height=HEIGHT, margin=0.0)
    ours, path = (rendered(render) for render in ways(make, scene, settings))
    print(
        f"{WIDTH}x{HEIGHT} tiles, {len(settings.bands_nm())} bands, {SAMPLES} paths per tile,"
        f" {REPEATS} renderings of either way"
    )
    print(f"CPU s of a rendering of all groups: ours {ours.seconds:.1f}, path {path.seconds:.1f}")
    times = []
    for g, group in enumerate(scene.light_groups()):
        pair = ours.radiance[:, g], path.radiance[:, g]
        reference = np.concatenate(pair).mean(0)
        errors = [median_error(light, reference) for light in pair]
        times.append(path.seconds * errors[1] ** 2 / (ours.seconds * errors[0] ** 2))
        ratio, standard_error = agreement(*pair)
        print(
            f"{group:13s} error: ours {errors[0]:.4f}, path {errors[1]:.4f};"
            f" light: ours / path {ratio:.4f} +- {standard_error:.4f}\n"
            f"{'':13s} CPU s to equal error: path / ours {times[-1]:.1f}"
        )
    print(f"geometric mean of the groups: {np.exp(np.log(times).mean()):.1f} times")


if __name__ == "__main__":
    sys.exit(main())
