"""Study `render_noise`: whether noise of the renderer, or denoising, changes the result of `dirt`.

The study `dirt` runs four times: with the stored radiance, with each of its half buffers (twice the
variance of the renderer's noise), and with denoised radiance. If noise shifts a result in
proportion to its variance, the mean result of both buffers minus the stored result is the shift of
the stored result.
"""

from __future__ import annotations

import math
from typing import Any

from ..dataset.study.intervals import mean_over_roads
from ..markdown_table import markdown_table
from .dirt import Asked, asked_of, losses, scored
from .radiance_versions import STORED
from .tables import checked_page, columns, shown, write_page
from .term_scores import NEED_NOISE, SCORES, TERMS, Values

HALF_BUFFERS = ("half_a", "half_b")
DENOISED = "denoised"


def render_noise(
    *overrides: str,
    dataset: str = "streets",
    cameras: str = "bayer",
    scenes: int = 0,
    shots: int = 1,
    page: str = "",
) -> list[dict[str, Any]]:
    """Test whether noise of the renderer changes the result of the study dirt.

    Parameters
    ----------
    overrides : overrides of all scenes, for example flare@flare.dirt=aperture_fingerprint.
    dataset : name of the dataset; its stored radiance is read.
    cameras : names of cameras of the main config, or of sensor presets, separated by commas.
    scenes : number of scenes; 0: all.
    shots : noise realisations over which each score is averaged.
    page : file for the tables (Markdown); empty writes none.

    Returns
    -------
    rows with camera, score, term, `rule`, `shapley` (loss by the stored radiance), `half_buffers`
    and `denoised` (change of this loss, paired by scene, with 95 % limits over roads), and
    `changes`, the names of those that differ from 0 and move the result beyond the 95 % limits of
    `shapley`. For `dynamic_range`, which is defined only with noise, the rule is `last` and
    `shapley` the loss by the term as the last one; else the rule is `Shapley`.
    """
    checked_page(page)
    asked = asked_of(dataset, cameras, scenes, shots, overrides)
    answers = {version: scored(asked, version) for version in (STORED, *HALF_BUFFERS, DENOISED)}
    rows = rows_of(asked, answers)
    if page:
        head = [
            "camera",
            "score",
            "term",
            "rule",
            "loss",
            "half the samples",
            "denoised",
            "changes",
        ]
        table = [
            [
                *(str(row[name]) for name in ("camera", "score", "term", "rule")),
                *(shown(row, name) for name in ("shapley", "half_buffers", DENOISED)),
                str(row["changes"]),
            ]
            for row in rows
        ]
        write_page(page, markdown_table(head, table))
    return rows


def rows_of(asked: Asked, answers: dict[str, list[dict[str, Values]]]) -> list[dict[str, Any]]:
    """Return the rows of the study.

    Parameters
    ----------
    asked : scenes and cameras.
    answers : {version of the radiance: scores of each scene}.
    """
    roads = [source.road or source.name for source in asked.sources]
    rows = []
    for camera in asked.cameras:
        for score in SCORES:
            for term in TERMS:
                rule = "last" if score in NEED_NOISE else "Shapley"
                loss = f"{rule.lower()} {term}"
                of = {
                    version: [losses(one[camera], score)[loss] for one in found]
                    for version, found in answers.items()
                }
                stored = of[STORED]
                by_half_buffers = [
                    (a + b) / 2 - s
                    for a, b, s in zip(*(of[h] for h in HALF_BUFFERS), stored, strict=True)
                ]
                smooth = [d - s for d, s in zip(of[DENOISED], stored, strict=True)]
                row: dict[str, Any] = {"camera": camera, "score": score}
                row |= {"term": term, "rule": rule}
                row |= columns("shapley", mean_over_roads(stored, roads))
                row |= columns("half_buffers", mean_over_roads(by_half_buffers, roads))
                row |= columns(DENOISED, mean_over_roads(smooth, roads))
                rows.append(row | {"changes": changes(row)})
    return rows


def changes(row: dict[str, Any]) -> str:
    """Return the names of the changes that alter a result: `half_buffers`, `denoised`, both, or
    `none`.

    A change alters a result if it differs from 0 with 95 % confidence and the changed value lies
    beyond the 95 % limits of the stored result.
    """
    found = []
    for name in ("half_buffers", DENOISED):
        told = row[f"{name}_low"] > 0 or row[f"{name}_high"] < 0
        after = row["shapley"] + row[name]
        inside = row["shapley_low"] <= after <= row["shapley_high"]
        if told and not inside and not math.isnan(row["shapley_low"]):
            found.append(name)
    return " ".join(found) or "none"
