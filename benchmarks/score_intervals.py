"""The share of 95 % intervals that hold the score without renderer noise, with the renderer
reseeded 40 times.

Three scenes of 48 x 27 tiles go through three cameras of about 96 x 54 pixels: a night drive, a
tunnel and a country
road without street lamps. Each rendering has 256 samples per tile and random numbers of its own,
and so has its sensor
noise. A run of four shots gives each score an interval. The interval should hold the mean score of
48 shots of
two renderings with 4096 samples per tile. That mean has noise too, about a fifth of that of one
rendering with 256. Run:

    python benchmarks/score_intervals.py [--first-seed 3000] [night_drive tunnel rural]
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

CASES = {
    "night_drive": ("experiment=night_drive", "sensor=split_pixel", "scene.seed=31"),
    "tunnel": ("experiment=tunnel_exit", "sensor=bayer", "scene.seed=4"),
    "rural": ("experiment=night_drive", "scene=night_drive_rural", "sensor=rgbw", "scene.seed=12"),
}
COMMON = (
    "renderer.width=48",
    "renderer.height=27",
    "renderer.step_nm=30",
    "report=false",
    "~flare.dirt",
    "+metric@metric.level=ideal",
)
PIXELS = 96  # across the camera
FIRST_SEED, RENDERINGS, SAMPLES = 2000, 40, 256
TRUE_SEEDS, TRUE_SAMPLES, TRUE_SHOTS = (9001, 9002), 4096, 48


def parts_of(case: str):
    """Return the chain of a case, with two pixels per tile across the field."""
    import isethdr_core as hdr
    from isethdr_core.pipeline.chain import chain

    trees = () if case == "tunnel" else ("scene.trees=[1,2]",)
    return chain(hdr.compose([*CASES[case], *COMMON, *trees]))


def rendered(case: str, samples: int, seed: int):
    """Return the scene radiance of one rendering."""
    from isethdr_core.ledger import Ledger
    from isethdr_core.pipeline.chain import plan
    from isethdr_core.quantities import LABELS

    parts = parts_of(case)
    renderer = replace(parts.renderer, samples=samples, seed=seed)
    scene = renderer(parts.scene(), plan(parts, Ledger())).load()
    # without labels there are no scores of objects, which take most of the time
    return scene.drop_vars([label for label in LABELS if label in scene])


def scores_of(case: str, scene, noise: str, shots: int = 4) -> list:
    """Return the scores of a camera that looks at a rendering; `noise` names the sensor's noise
    realisations.
    """
    import isethdr_core as hdr
    from isethdr_core.ledger import Ledger
    from isethdr_core.pipeline.chain import imaging, plan, through_camera
    from isethdr_core.pipeline.shot import Shot

    parts = parts_of(case)
    ((name, sensor),) = parts.cameras.items()
    mixed = parts.lighting(scene)
    focal_length_mm = PIXELS * sensor.pitch_um * 1e-3 / mixed.attrs["field_width"]
    lens = replace(parts.lens, focal_length_mm=focal_length_mm)
    parts = replace(parts, lens=lens, draws=shots)
    demand = plan(parts, Ledger())
    made = imaging(parts, mixed, demand)
    light = made.light()
    random = hdr.generator(seed=0, device="A", scene=noise)
    shot = Shot(light, mixed, scene, random, made)
    return through_camera(parts, Ledger(), name, shot).scores


def true_scores(case: str) -> dict[str, float]:
    """Return the mean scores of many shots of long renderings."""
    found: dict[str, list[float]] = {}
    for seed in TRUE_SEEDS:
        # without half buffers no renderer noise is looked for
        scene = rendered(case, TRUE_SAMPLES, seed).drop_vars("half_difference")
        for score in scores_of(case, scene, f"{case} {seed}", TRUE_SHOTS):
            found.setdefault(score.metric, []).append(score.value)
    return {name: float(np.mean(values)) for name, values in found.items()}


def intervals(case: str, first_seed: int) -> dict[str, np.ndarray]:
    """Return an array (value, low, high) per rendering, of each score."""
    found: dict[str, list] = {}
    for seed in range(first_seed, first_seed + RENDERINGS):
        for score in scores_of(case, rendered(case, SAMPLES, seed), f"{case} {seed}"):
            found.setdefault(score.metric, []).append((score.value, score.low, score.high))
    return {name: np.array(rows) for name, rows in found.items()}


def compare(case: str, first_seed: int) -> list[bool]:
    """Print the table of one case; return which intervals hold their score."""
    true, found = true_scores(case), intervals(case, first_seed)
    print(f"\n{case}: {RENDERINGS} renderings of {SAMPLES} samples per tile")
    print(f"{'score':32s} {'true':>9s} {'rms off':>9s} {'rms half':>9s} {'inside':>7s} {'of':>4s}")
    every: list[bool] = []
    for name, rows in found.items():
        value, low, high = rows[np.isfinite(rows).all(axis=1)].T
        at = true.get(name, np.nan)
        if not (np.isfinite(at) and len(value)):
            continue
        # a score that no noise moves is equal but for rounding
        rounding = 1e-6 * abs(at)
        inside = (low - rounding <= at) & (at <= high + rounding)
        every.extend(map(bool, inside))
        off = np.sqrt(np.mean((value - at) ** 2))
        half = np.sqrt(np.mean(((high - low) / 2) ** 2))
        print(f"{name:32s} {at:9.4g} {off:9.2g} {half:9.2g} {inside.mean():7.3f} {len(value):4d}")
    print(f"all: {np.mean(every):.3f} of {len(every)} intervals", flush=True)
    return every


def main() -> None:
    """Print the tables of the named cases, or of all, and the share over all scores."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], help="default: all")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the renderer")
    options = parser.parse_args()
    every = [
        inside for case in options.cases or CASES for inside in compare(case, options.first_seed)
    ]
    print(f"\nall scenes: {np.mean(every):.3f} of {len(every)} intervals")


if __name__ == "__main__":
    main()
