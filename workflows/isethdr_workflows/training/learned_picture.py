"""Learned against classical pictures of held-out roads, by illuminance, road by road."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from isethdr_isp.develop import solve_matrix
from isethdr_isp.merge import charges
from isethdr_isp.scene_light import illuminant
from isethdr_isp.spectra import Illuminant

from isethdr_core import generator
from isethdr_core.display.display_view import display, white_cd_m2
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build
from isethdr_core.truth import make_picture, truth

from ..dataset.study.intervals import Mean, mean_over_roads
from .picture.camera import TrainingCamera, camera_of
from .picture.roads import TRAIN, Lit, lit, roads_of

CLASSICAL = {
    "demosaic": ("bilinear", "learned"),
    "denoise": ("none", "nl_means"),
    "design_snr": (1.0, 5.0, 20.0),
    "balance": ("daylight", "automatic"),
}
SCORES = {"ssim": 1.0, "psnr_db": 1.0, "ciede2000": -1.0}  # sign: larger is better
LEVEL_PERCENTILE = 95.0  # of the illuminance: what is above it does not count for the level
BYTE = 255.0


class Measured(NamedTuple):
    """Scores of one picture, and the seconds that its development took."""

    scores: dict[str, float]
    seconds: float


@dataclass(frozen=True, eq=False)
class Contest:
    """Developments of one camera at one illuminance, on the same shots.

    Parameters
    ----------
    camera : of the shots.
    lux : illuminance of the sensor plane; the brightest twentieth of it is clipped for this.
    """

    camera: TrainingCamera
    lux: float

    def shot(self, view: Lit, seed: int) -> tuple[Any, Any]:
        """Return captures of a road at the illuminance, and its reference picture."""
        level = illuminance(view.light)
        factor = np.float32(self.lux / level)
        light = view.light.copy(data=view.light.values * factor)
        mixed = view.mixed.copy(data=view.mixed.values * factor)
        captures = self.camera.sensor(light, generator(seed, scene="learned picture"))
        reference = truth(mixed, build("isp", "merge")(captures))
        return captures, (reference, light)

    def classical(self, views: Sequence[Lit]) -> dict[str, dict[str, Any]]:
        """Return the classical development that is best on some roads, for each score."""
        names = list(CLASSICAL)
        choices = [dict(zip(names, values)) for values in product(*CLASSICAL.values())]
        totals = {score: np.zeros(len(choices)) for score in SCORES}
        for seed, view in enumerate(views):
            captures, (reference, _) = self.shot(view, seed)
            for k, fields in enumerate(choices):
                found = measured(build("isp", "merge", **fields), captures, reference).scores
                for score, sign in SCORES.items():
                    totals[score][k] += sign * found[score]
        return {score: choices[int(values.argmax())] for score, values in totals.items()}


def learned_picture(
    *overrides: str,
    model: str = "",
    dataset: str = "streets",
    part: str = "test",
    lux: str = "0.01,0.1,1,10",
    tuned_on: int = 3,
) -> list[dict]:
    """Compare a network with the best classical development on roads that it was not trained on.

    Parameters
    ----------
    overrides : of the config: the sensor that the model is for, and the lens.
    model : ONNX file of `isp=network`.
    dataset : name of a dataset of the home, or the folder of one in another home.
    part : of the dataset: test, or validation.
    lux : mean illuminances of the sensor plane, parted by commas; what is above the 95th
        percentile of a picture counts as that.
    tuned_on : training roads on which demosaic, denoise, design_snr and balance are chosen.

    Returns
    -------
    rows with lux, score, network, classical, difference with low and high, roads, matrix_alone
    (no noise, no mosaic: what the colour matrix leaves), network_s and classical_s (seconds of
    one picture), best_classical.
    """
    if not model:
        raise ConfigError("learned_picture needs a model; type model=FILE.onnx")
    camera = camera_of(overrides)
    network = build("isp", "network", model=model)
    network.check_shot(camera.sensor.shot_form())
    roads = roads_of(dataset)
    held_out = roads.of(part)
    if not held_out or part == TRAIN:
        raise ConfigError(
            f"the part {part!r} of {roads.name} has {len(held_out)} scenes that no training saw;"
            " type for example part=test"
        )
    tuning = [lit(road, camera, overrides) for road in roads.of(TRAIN)[:tuned_on]]
    contests = [Contest(camera, level) for level in levels(lux)]
    best = [contest.classical(tuning) for contest in contests]
    found: list[list[dict[str, Any]]] = [[] for _ in contests]
    for road in held_out:
        view = lit(road, camera, overrides)
        for contest, developments, rows in zip(contests, best, found):
            rows.append(compared(contest, view, network, developments) | {"road": road})
    return [
        row_of(contest.lux, score, developments[score], rows)
        for contest, developments, rows in zip(contests, best, found)
        for score in SCORES
    ]


def levels(text: str) -> list[float]:
    """Return illuminances from a text, parted by commas."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or min(found) <= 0:
        raise ConfigError(f"lux is {text!r}; expected numbers above 0; type for example lux=0.1,1")
    return found


def illuminance(light: Any) -> float:
    """Return the mean illuminance, lux, of a sensor plane without its brightest parts."""
    lux = luminance(light.values.astype(float), light.wavelength.values)
    return float(np.minimum(lux, np.percentile(lux, LEVEL_PERCENTILE)).mean())


def compared(
    contest: Contest, view: Lit, network: Any, developments: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return what network, classical developments and the matrix alone make of one shot."""
    captures, (reference, light) = contest.shot(view, seed=1000)
    alone = scores_of(matrix_alone(captures, light, "automatic"), reference)
    by_fields = {
        tuple(fields.items()): measured(build("isp", "merge", **fields), captures, reference)
        for fields in developments.values()
    }
    return {
        "network": measured(network, captures, reference),
        "classical": {
            score: by_fields[tuple(fields.items())] for score, fields in developments.items()
        },
        "matrix_alone": alone,
    }


def measured(isp: Any, captures: Any, reference: Any) -> Measured:
    """Return the scores of what an isp makes of captures, and its seconds."""
    started = time.perf_counter()
    picture = isp(captures)
    seconds = time.perf_counter() - started
    return Measured(scores_of(picture, reference), seconds)


def scores_of(picture: Any, reference: Any) -> dict[str, float]:
    """Return SSIM, PSNR of the displayed pictures in dB, and mean CIEDE2000.

    PSNR is 20 log10(255 / rms) over all pixels and channels of the views that SSIM compares.
    """
    white = white_cd_m2(reference)
    ours, meant = (display(p, white).astype(float) for p in (picture, reference))
    rms = float(np.sqrt(np.mean((ours - meant) ** 2)))
    return {
        "ssim": build("metric", "ssim")(picture, reference)[0].value,
        "psnr_db": 20 * np.log10(BYTE / rms) if rms > 0 else float("inf"),
        "ciede2000": build("metric", "ciede2000")(picture, reference)[0].value,
    }


def matrix_alone(captures: Any, light: Any, balance: str) -> Any:
    """Return the picture of electrons without noise, each pixel with every filter, through the
    colour matrix: no step before the matrix can do better.
    """
    by: Illuminant = illuminant(captures, balance)
    groups, _ = charges(captures, by)
    response = groups[-1][0].response
    wavelength_nm = captures.wavelength.values
    matrix = solve_matrix(response, wavelength_nm, by, np.inf)
    radiance = light.values / light.attrs["throughput_sr"]
    planes = np.tensordot(matrix @ response, radiance, axes=1)
    first = [(have - want) // 2 for have, want in zip(planes.shape[1:], captures.filter.shape)]
    rows, columns = (
        slice(start, start + size) for start, size in zip(first, captures.filter.shape)
    )
    xyz = np.moveaxis(planes[:, rows, columns], 0, -1)
    attrs = {k: captures.attrs[k] for k in ("pitch_um", "focal_length_mm")}
    valid = np.ones(xyz.shape[:2], bool)
    variance = np.full(xyz.shape, np.nan)  # not known
    x = captures.x.values
    y = captures.y.values
    return make_picture(xyz, variance, valid, x, y, variance_known=False, **attrs)


def row_of(
    lux: float, score: str, fields: dict[str, Any], rows: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """Return one row of the table."""
    network = [row["network"].scores[score] for row in rows]
    classical = [row["classical"][score].scores[score] for row in rows]
    roads = [row["road"].record.road for row in rows]
    difference: Mean = mean_over_roads(np.subtract(network, classical).tolist(), roads)
    return {
        "lux": lux,
        "score": score,
        "network": float(np.mean(network)),
        "classical": float(np.mean(classical)),
        "difference": difference.value,
        "low": difference.low,
        "high": difference.high,
        "roads": difference.roads,
        "matrix_alone": float(np.mean([row["matrix_alone"][score] for row in rows])),
        "network_s": float(np.median([row["network"].seconds for row in rows])),
        "classical_s": float(np.median([row["classical"][score].seconds for row in rows])),
        "best_classical": " ".join(f"{key}={value}" for key, value in fields.items()),
    }
