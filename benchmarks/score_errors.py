"""Stated errors of scores from one rendering, against the actual errors of repeats with other
random numbers.

The scenes are a street (48 x 27 tiles, one pixel per tile, 16 and 96 paths, 32 renderings against
one of 4096 paths) and a night drive (192 x 108 tiles, 24 paths, 2 x 2 pixels per tile, 10
renderings against one of 512 paths), both through an ideal lens and a colour filter array. For each
score the tables state the actual rms error, its mean, and the rms of the errors stated by single
renderings over the actual rms error. Stated errors come from changes of the whole picture, or of
parts of it. Run:

    python benchmarks/score_errors.py
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from render_light_groups import tests_scenes

if TYPE_CHECKING:
    from isethdr_core.scene import SceneDescription

METRICS = (
    "ideal",
    "snr_curve",
    "dynamic_range",
    "ciede2000",
    "ssim",
    "log_luminance_error",
    "contrast_detection",
)
WHOLE = 10**6  # block size, pixels, for which no picture is cut into parts


def camera_of(scene, weights, tiles_wide, pitch_um):
    """Return a shot of a scene with tiles 3 um wide on the sensor, and the metrics, as arguments of
    `score_errors.of_scores`.

    Parameters
    ----------
    scene : scene radiance.
    weights : weights of light groups; 1 for groups that are not named.
    tiles_wide : number of tiles across the field.
    pitch_um : pixel pitch, um.
    """
    import isethdr_core as hdr
    from isethdr_core.truth import truth
    from isethdr_core.uncertainty.changed_scenes import ScoredShot

    mixed = hdr.build(
        "lighting",
        "weights",
        weights={g: weights.get(g, 1.0) for g in map(str, scene.light_group.values)},
    )(scene)
    light = hdr.build(
        "lens",
        "ideal",
        f_number=2.0,
        focal_length_mm=3e-3 * tiles_wide / mixed.attrs["field_width"],
    )(mixed)
    sensor = hdr.build("sensor", "bayer", pitch_um=pitch_um)
    isp = hdr.build("isp", "linear")
    metrics = [hdr.build("metric", m) for m in METRICS]
    again = lambda changed: isp(sensor(changed, hdr.generator(seed=0)))
    picture = again(light)
    reference = truth(mixed, picture)
    scores = [s for metric in metrics for s in metric(picture, reference, None)]
    return ScoredShot(picture, reference, None, scores, light, mixed, scene, again), metrics


def stated(shot, metrics, block: int, count: int) -> dict[str, float]:
    """Return the stated error of each score.

    Parameters
    ----------
    shot, metrics : results of `camera_of`.
    block : side of the blocks of pixels that make up the parts of a picture, pixels.
    count : number of changes of the scene.
    """
    from isethdr_core.uncertainty import changed_scenes, score_errors

    changed_scenes.BLOCK = block
    return {t.part: t.value for t in score_errors.of_scores(shot, metrics, count).terms}


@dataclass(frozen=True)
class Case:
    """A scene and its camera."""

    title: str
    description: SceneDescription
    weights: dict[str, float]  # weights of light groups; 1 for groups that are not named
    tiles: tuple[int, int]  # (width, height)
    pitch_um: float  # pixel pitch; tiles are 3 um wide


@dataclass(frozen=True)
class Effort:
    """Paths per tile and number of renderings."""

    samples: int  # paths per tile of a rendering that states its errors
    seeds: int  # number of such renderings
    judge: int  # paths per tile of the reference rendering


def compare(case: Case, effort: Effort, ways: dict[str, tuple[int, int]]) -> None:
    """Print the table of one scene; `ways` names pairs of `block` and `count`."""
    from isethdr_mitsuba.renderer import MitsubaRenderer

    def scores_of(seed, paths):
        scene = MitsubaRenderer(
            width=case.tiles[0],
            height=case.tiles[1],
            margin=0.0,
            samples=paths,
            step_nm=50.0,
            seed=seed,
        )(case.description)
        return camera_of(scene, case.weights, case.tiles[0], case.pitch_um)

    start = time.process_time()
    true = {s.metric: s.value for s in scores_of(99, effort.judge)[0].scores}
    true_scores = {}
    said = {way: {} for way in ways}
    for seed in range(effort.seeds):
        shot, metrics = scores_of(seed, effort.samples)
        for s in shot.scores:
            true_scores.setdefault(s.metric, []).append(s.value - true.get(s.metric, np.nan))
        for way, (block, count) in ways.items():
            for name, value in stated(shot, metrics, block, count).items():
                said[way].setdefault(name, []).append(value)
    print(
        f"\n{case.title}, {effort.samples} paths, {effort.seeds} renderings against one of"
        f" {effort.judge} paths"
        f" ({time.process_time() - start:.0f} CPU s)"
    )
    print(f"{'score':32s} {'value':>9s} {'off':>9s} {'shift':>9s}  stated/off: " + ", ".join(ways))
    for name, off in true_scores.items():
        rms = float(np.sqrt(np.mean(np.square(off))))
        ratios = [
            float(np.sqrt(np.mean(np.square(said[way].get(name, [np.nan]))))) / rms for way in ways
        ]
        print(
            f"{name:32s} {true.get(name, np.nan):9.3g} {rms:9.2g} {np.mean(off):9.2g}  "
            + "  ".join(f"{ratio:.2f}" for ratio in ratios)
        )


def main() -> None:
    """Print both tables."""
    import isethdr_core as hdr

    street = tests_scenes().street(8)
    night = hdr.build("scene", "night_drive", seed=23)()
    for samples in (16, 96):
        compare(
            Case("street", street, {}, (48, 27), 3.0),
            Effort(samples, 32, 4096),
            {"12 changes": (WHOLE, 12)},
        )
    compare(
        Case("night drive", night, {"sky": 1e-5}, (192, 108), 1.5),
        Effort(24, 10, 512),
        {"6 changes": (WHOLE, 6), "parts": (36, 6)},
    )


if __name__ == "__main__":
    main()
