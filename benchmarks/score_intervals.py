"""The share of 95 % intervals that contain the score without renderer noise, over 40 seeds of the
renderer.

Three scenes of 48 x 27 tiles are captured by three cameras of about 96 x 54 pixels: a night drive,
a tunnel and a country road without street lamps. Each rendering has 256 samples per tile and its
own random numbers, and so has its sensor noise. A run of four shots gives each score an interval.
The interval should contain the mean score of 48 shots of two renderings with 4096 samples per tile.
That mean has noise too, about a fifth of the noise of one rendering with 256 samples. A rare path,
such as a mirror image of a lamp that covers a thousandth of a tile, may be in only one of the two
long renderings. The column "apart" is half of their difference; a share is meaningful only if it is
small compared with the intervals. Run:

    python benchmarks/score_intervals.py [--first-seed 3000] [night_drive tunnel rural]

Large pictures, which are evaluated in parts:

    python benchmarks/score_intervals.py --large rural
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np

CASES = {
    "night_drive": ("experiment=night_drive", "sensor=split_pixel", "scene.seed=31"),
    "tunnel": ("experiment=tunnel_exit", "sensor=bayer", "scene.seed=4"),
    "rural": ("experiment=night_drive", "scene=night_drive_rural", "sensor=rgbw", "scene.seed=12"),
}
COMMON = ("renderer.step_nm=30", "report=false", "~flare.dirt", "+metric@metric.level=ideal")
TRUE_SEEDS = (9001, 9002)


@dataclass(frozen=True)
class Setting:
    """Size of a check. Pictures of 288 pixels and more along both axes are evaluated in parts."""

    tiles: int = 48  # number of tiles across the field
    pixels: int = 96  # number of pixels across the picture
    first_seed: int = 2000  # first seed of the renderer
    renderings: int = 40
    samples: int = 256  # samples per tile
    true_samples: int = 4096
    true_shots: int = 48


# fewer and shorter renderings, because large pictures take longer
LARGE = Setting(96, 528, renderings=14, samples=128, true_samples=1024, true_shots=12)


def parts_of(case: str, setting: Setting):
    """Return the chain of a case."""
    import isethdr_core as hdr
    from isethdr_core.pipeline.chain import chain

    size = f"renderer.width={setting.tiles}", f"renderer.height={setting.tiles * 9 // 16}"
    trees = () if case == "tunnel" else ("scene.trees=[1,2]",)
    return chain(hdr.compose([*CASES[case], *COMMON, *size, *trees]))


def rendered(case: str, setting: Setting, samples: int, seed: int):
    """Return the scene radiance of one rendering.

    Parameters
    ----------
    case : name of the case.
    setting : size of the check.
    samples : samples per tile.
    seed : seed of the renderer.
    """
    from isethdr_core.ledger import Ledger
    from isethdr_core.pipeline.chain import plan
    from isethdr_core.quantities import LABELS

    parts = parts_of(case, setting)
    renderer = replace(parts.renderer, samples=samples, seed=seed)
    scene = renderer(parts.scene(), plan(parts, Ledger())).load()
    # without labels there are no scores of objects, which take most of the time
    return scene.drop_vars([label for label in LABELS if label in scene])


def scores_of(case: str, setting: Setting, scene, noise: str, shots: int = 4) -> list:
    """Return the scores of a camera's pictures of a rendering.

    Parameters
    ----------
    case : name of the case.
    setting : size of the check.
    scene : scene radiance.
    noise : name from which the sensor's noise realisations are seeded.
    shots : number of noise realisations.
    """
    import isethdr_core as hdr
    from isethdr_core.ledger import Ledger
    from isethdr_core.pipeline.chain import imaging, plan, through_camera
    from isethdr_core.pipeline.shot import Shot

    parts = parts_of(case, setting)
    ((name, sensor),) = parts.cameras.items()
    mixed = parts.lighting(scene)
    focal_length_mm = setting.pixels * sensor.pitch_um * 1e-3 / mixed.attrs["field_width"]
    lens = replace(parts.lens, focal_length_mm=focal_length_mm)
    parts = replace(parts, lens=lens, draws=shots)
    demand = plan(parts, Ledger())
    optics = imaging(parts, mixed, demand)
    light = optics.light()
    random = hdr.generator(seed=0, device="A", scene=noise)
    shot = Shot(light, mixed, scene, random, optics)
    return through_camera(parts, Ledger(), name, shot).scores


class TrueScore(NamedTuple):
    """The mean score of many shots of two long renderings."""

    mean: float
    apart: float  # half of the difference of the two renderings


def true_scores(case: str, setting: Setting) -> dict[str, TrueScore]:
    """Return the scores of long renderings."""
    scores: dict[str, list[float]] = {}
    for seed in TRUE_SEEDS:
        # without half buffers no renderer noise is estimated
        scene = rendered(case, setting, setting.true_samples, seed).drop_vars("half_difference")
        for score in scores_of(case, setting, scene, f"{case} {seed}", setting.true_shots):
            scores.setdefault(score.metric, []).append(score.value)
    return {
        name: TrueScore(float(np.mean(values)), float(np.ptp(values)) / 2)
        for name, values in scores.items()
    }


def intervals(case: str, setting: Setting) -> dict[str, np.ndarray]:
    """Return for each score an array (rendering, 3) of value, low and high."""
    interval_rows: dict[str, list] = {}
    for seed in range(setting.first_seed, setting.first_seed + setting.renderings):
        scene = rendered(case, setting, setting.samples, seed)
        for score in scores_of(case, setting, scene, f"{case} {seed}"):
            interval_rows.setdefault(score.metric, []).append((score.value, score.low, score.high))
    return {name: np.array(rows) for name, rows in interval_rows.items()}


def compare(case: str, setting: Setting) -> list[bool]:
    """Print the table of one case; return for each interval whether it contains its score."""
    true = true_scores(case, setting)
    stated = intervals(case, setting)
    print(
        f"\n{case}: {setting.pixels} pixels and {setting.tiles} tiles across,"
        f" {setting.samples} samples, {setting.renderings} renderings from seed"
        f" {setting.first_seed}"
    )
    print(
        f"true: {len(TRUE_SEEDS)} renderings of {setting.true_samples} samples,"
        f" {setting.true_shots} shots each"
    )
    print(
        f"{'score':32s} {'true':>9s} {'apart':>9s} {'rms off':>9s} {'rms half':>9s} {'inside':>7s}"
        f" {'of':>4s}"
    )
    every: list[bool] = []
    for name, rows in stated.items():
        value, low, high = rows[np.isfinite(rows).all(axis=1)].T
        at, apart = true.get(name, TrueScore(np.nan, np.nan))
        if not (np.isfinite(at) and len(value)):
            continue
        # a score without any noise differs by rounding only
        rounding = 1e-6 * abs(at)
        inside = (low - rounding <= at) & (at <= high + rounding)
        every.extend(map(bool, inside))
        off = np.sqrt(np.mean((value - at) ** 2))
        half = np.sqrt(np.mean(((high - low) / 2) ** 2))
        print(
            f"{name:32s} {at:9.4g} {apart:9.2g} {off:9.2g} {half:9.2g} {inside.mean():7.3f}"
            f" {len(value):4d}"
        )
    print(f"all: {np.mean(every):.3f} of {len(every)} intervals", flush=True)
    return every


def main() -> None:
    """Print the tables of the named cases, or of all, and the share over all scores."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], help="default: all")
    parser.add_argument("--large", action="store_true", help="pictures that are scored in parts")
    for name in asdict(LARGE):
        parser.add_argument(f"--{name.replace('_', '-')}", type=int)
    options = vars(parser.parse_args())
    cases = options.pop("cases")
    setting = LARGE if options.pop("large") else Setting()
    setting = replace(setting, **{name: n for name, n in options.items() if n is not None})
    every = [inside for case in cases or CASES for inside in compare(case, setting)]
    print(f"\nall scenes: {np.mean(every):.3f} of {len(every)} intervals")


if __name__ == "__main__":
    main()
