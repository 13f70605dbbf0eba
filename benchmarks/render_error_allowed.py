"""Stated noise and cost of the renderer's stopping rule `error_allowed`, against long renderings
and against numbers of paths chosen by hand.

Three scenes are rendered at 96 x 54 tiles. The renderer stops when the noise of each light group
reaches the allowed error. The reference rendering ("judge") follows at least 10 times as many paths
with other random numbers; its own noise makes errors look up to 5 % larger. Errors are
luminance-weighted medians of |light / judge - 1| over tiles above 1 % of a group's mean. For normal
noise this median is 0.67 standard errors, so the rule is compared with an error of 0.67 times the
allowed one.

Two numbers of paths are chosen by hand: the least number for all groups together, in steps of a
fifth, that brings the error of every group to this goal; and the least number for each group, which
nobody knows beforehand. Directly visible lamps have no noise, are equal in all renderings, and are
left out. Times are CPU seconds of this process. Kernels are compiled in the renderer's first call,
never in the renderings by hand. Run:

    python benchmarks/render_error_allowed.py
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import replace

import numpy as np
from render_light_groups import tests_scenes

LEAST = 10  # least number of paths of the judge over those of the finest rendering
NORMAL = 0.6745  # median |error| of a normal distribution, in standard deviations
STEP = 1.2  # ratio of successive numbers of paths chosen by hand


def scenes():
    """Yield name, maker of the description, and allowed errors of the scenes."""
    import isethdr_core as hdr

    yield "street, 20 boxes, seed 8", lambda: tests_scenes().street(20, seed=8), (0.3, 0.1)
    yield "tunnel, seed 11", hdr.build("scene", "tunnel", seed=11), (0.3, 0.2, 0.1)
    yield "night_drive, seed 23", hdr.build("scene", "night_drive", seed=23), (0.3, 0.2, 0.1)


def passes_of(scene, settings):
    """Return the function of one pass over all light groups of a scene, the names of the groups,
    the bands, and the shape of the grid.
    """
    from isethdr_mitsuba.frame import Built, Cube, even_passes, follower
    from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    groups = list(scene.light_groups())
    bands = settings._bands(None)
    view = view_of(scene.camera, settings.width, settings.height, settings.margin)
    surfaces = ramp_surfaces(scene)
    one_pass = even_passes(
        follower(
            scene,
            Built(build_world(scene, surfaces), surfaces),
            placed_lamps(scene),
            Cube(groups, bands, view),
            settings,
        )
    )
    return one_pass, groups, bands, view.shape


def timed(call):
    """Return CPU seconds and the result of `call()`."""
    start = time.process_time()
    result = call()
    return time.process_time() - start, result


def luminance_of(radiance, bands):
    """Return luminance (group, tile) of radiance (group, wavelength, row, column)."""
    from isethdr_core.physics.photometry import luminance

    return np.stack([luminance(cube, bands).ravel() for cube in radiance])


def median_error(rendering, judge):
    """Return the luminance-weighted median of |rendering / judge - 1| of one group.

    Tiles above 1 % of its mean count, without those that are equal up to rounding, such as the sky.
    """
    from isethdr_mitsuba.paths.passes import ROUNDING, weighted_median

    error = np.abs(rendering / np.where(judge > 0, judge, 1.0) - 1)
    used = (judge > 0.01 * judge.mean()) & (error > ROUNDING)
    return weighted_median(error[used], judge[used])


def main():
    """Print one table per scene; names given on the command line choose among them."""
    with tempfile.TemporaryDirectory() as nothing_compiled:
        os.environ["HOME"] = nothing_compiled
        import mitsuba as mi
        from isethdr_mitsuba.doctor import choose_variant

        mi.set_variant(choose_variant("llvm"))
        for name, make, errors in scenes():
            if not sys.argv[1:] or any(name.startswith(wanted) for wanted in sys.argv[1:]):
                table(name, make(), errors)


def table(name, scene, errors):
    """Print for each allowed error of one scene the true error, the CPU seconds, and the CPU
    seconds with numbers of paths chosen by hand.
    """
    from isethdr_mitsuba.paths.passes import Frame, estimate
    from isethdr_mitsuba.renderer import MitsubaRenderer

    settings = MitsubaRenderer(
        width=96, height=54, margin=0.0, step_nm=100.0, samples=16, most_samples=100_000, seed=1
    )
    one_pass, groups, bands, shape = passes_of(scene, settings)
    every = range(len(groups))

    def follow(**fields):
        return timed(
            lambda: estimate(one_pass, replace(settings, **fields), Frame(groups, bands, shape))
        )

    first, _ = follow(error_allowed=errors[0])
    runs = {allowed: follow(error_allowed=allowed) for allowed in errors}
    compiling = first - runs[errors[0]][0]
    seconds, judge = timed(lambda: judged(one_pass, runs[min(errors)][1].samples, bands))
    print(
        f"{name}; kernel {compiling:.1f} CPU s, once; judge: at least {LEAST} x the paths,"
        f" {seconds:.0f} CPU s",
        flush=True,
    )
    for allowed, (spent, found) in runs.items():
        error = np.array(
            [
                median_error(a, b)
                for a, b in zip(luminance_of(found.radiance, bands), judge, strict=True)
            ]
        )
        goal = allowed * NORMAL
        picked = by_hand(one_pass, groups, bands, judge, goal, int(max(found.samples) * 4))
        hand, _ = follow(samples=int(picked.max()), seed=3)
        each, _ = timed(lambda picked=picked: group_by_group(one_pass, picked))
        for g in every:
            print(
                f"  allowed {allowed:g}  {groups[g]:13s} paths {found.samples[g]:5d}  stated"
                f" {found.noise[g]:.4f}  true {error[g]:.4f}  true / allowed"
                f" {error[g] / allowed:.2f}  by hand {picked[g]}",
                flush=True,
            )
        # seconds by hand for the true error of the renderer, in the groups that needed more than
        # the first paths: paths are proportional to 1 / error^2; without such groups, `hand`
        went_on = found.samples > settings.samples
        same = (
            hand * max((picked * (goal / np.maximum(error, 1e-9)) ** 2)[went_on]) / picked.max()
            if went_on.any()
            else hand
        )
        print(
            f"  allowed {allowed:g}  CPU s {spent:.2f}; by hand {hand:.2f}, ratio"
            f" {spent / hand:.2f}, at the same true error {spent / same:.2f}, with the kernel"
            f" {(spent + compiling) / same:.2f}; group by group {each:.2f}, ratio"
            f" {spent / each:.2f}",
            flush=True,
        )


def judged(one_pass, samples, bands):
    """Return the luminance (group, tile) of `LEAST` times `samples` (group,) paths with their own
    random numbers.
    """
    out = []
    for g, least in enumerate(samples):
        sizes = [1024] * int(np.ceil(LEAST * least / 1024))
        total = 0.0
        for k, n in enumerate(sizes):
            total = total + np.stack(
                [values for _, _, values in one_pass(10_000 + 100 * g + k, n, [g])]
            )
        out.append(total / len(sizes))
    return luminance_of(np.stack(out)[..., None, :], bands)


def by_hand(one_pass, groups, bands, judge, goal, most):
    """Return the least number of paths (group,), in steps of `STEP`, that brings each group's error
    to `goal`.
    """
    total = 0.0
    done = 0
    target = 4
    seed = 50_000
    samples = np.zeros(len(groups), int)
    while True:
        seed += 1
        part = np.zeros((len(groups), len(bands), judge.shape[1]))
        for g, band, values in one_pass(seed, target - done):
            part[g, band] += np.asarray(values, float)
        total = total + part * (target - done)
        done = target
        light = luminance_of((total / done)[..., None, :], bands)
        error = np.array([median_error(a, b) for a, b in zip(light, judge, strict=True)])
        samples[(samples == 0) & (error <= goal)] = done
        if samples.all() or done >= most:
            return np.where(samples, samples, done)
        target = int(np.ceil(done * STEP))


def group_by_group(one_pass, samples):
    """Follow `samples` (group,) paths per tile in as few passes as possible; drop their light."""
    done = 0
    for target in sorted(set(map(int, samples))):
        while done < target:
            more = min(target - done, 1024)
            list(one_pass(60_000 + done, more, np.flatnonzero(samples >= target).tolist()))
            done += more


if __name__ == "__main__":
    sys.exit(main())
