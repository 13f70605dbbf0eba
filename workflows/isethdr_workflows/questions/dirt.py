"""Study `dirt`: shares of scatter, ghosts and noise in the loss of scores through a dirty lens."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from isethdr_core.cli.terminal import duration, number_of
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.pipeline.chain import Chain
from isethdr_core.runs.provenance import described, fingerprint, input_digests, libraries
from isethdr_core.storage import store
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import home

from ..dataset.pairs.request import PairRequest
from ..dataset.pairs.sources import Source, families, sources
from ..dataset.study.intervals import mean_over_roads
from ..markdown_table import markdown_table
from .radiance_versions import STORED, checked_version
from .shares import ratio_over_roads, shares
from .tables import checked_page, columns, shown, write_page
from .term_scores import SCORES, SUBSETS, TERMS, Values, checked_chain, key_of, term_scores

OF_CONFIG = ("bayer", "split_pixel", "rgbw")  # cameras of the main config
# f/3 is the largest aperture of the ghosts' prescription; denoising would hide the loss by noise
OWN = (
    "lens.f_number=3",
    "+flare@flare.ghosts=ghosts_broadband",
    "isp=merge",
    *(f"~metric.{name}" for name in ("shares", "snr", "contrast")),
)


@dataclass(frozen=True)
class Asked:
    """The scenes, cameras and shots of a study."""

    sources: tuple[Source, ...]
    cameras: tuple[str, ...]
    shots: int


def dirt(
    *overrides: str,
    dataset: str = "streets",
    cameras: str = "bayer,split_pixel",
    scenes: int = 0,
    shots: int = 1,
    page: str = "",
) -> list[dict[str, Any]]:
    """Divide the loss behind a dirty lens into scatter, ghosts and noise, for each score.

    Parameters
    ----------
    overrides : overrides of all scenes, for example flare@flare.dirt=aperture_fingerprint.
    dataset : name of the dataset; its stored radiance is read.
    cameras : names of cameras of the main config, or of sensor presets, separated by commas.
    scenes : number of scenes, from the first one; 0: all.
    shots : number of noise realisations over which each score is averaged.
    page : file for the tables (Markdown); empty writes none.

    Returns
    -------
    rows with camera, score, term, `loss` (of all terms together, positive if the picture is worse),
    `first`, `last` and `shapley` (loss by the term as the first one, as the last one, and by
    Shapley's rule), `share` (of the loss by Shapley's rule), each with 95 % limits over roads;
    number of scenes and roads.
    """
    checked_page(page)
    asked = asked_of(dataset, cameras, scenes, shots, overrides)
    rows = rows_of(asked, scored(asked))
    if page:
        write_page(page, text_of(rows, asked))
    return rows


def asked_of(
    dataset: str, cameras: str, scenes: int, shots: int, overrides: Sequence[str]
) -> Asked:
    """Return the scenes, cameras and shots of a study. The chain of every kind of scene is checked.

    Parameters
    ----------
    dataset : name of the dataset.
    cameras : names of sensors, separated by commas.
    scenes : number of scenes; 0: all.
    shots : number of shots of each scene with different noise.
    overrides : overrides of the config, as typed.

    Raises
    ------
    ConfigError : a setting has a mistake, or a chain has no dirt or no ghosts.
    CatalogError : there is no such dataset.
    """
    if shots < 1 or scenes < 0:
        raise ConfigError(
            f"shots is {shots} and scenes is {scenes}; expected 1 or more shots and 0 or more"
            " scenes; type for example shots=2 scenes=10"
        )
    names = tuple(name.strip() for name in cameras.split(",") if name.strip())
    if not names:
        raise ConfigError("no camera is named; type for example cameras=bayer,split_pixel")
    chosen = [f"~sensor@cameras.{name}" for name in OF_CONFIG if name not in names]
    chosen += [f"+sensor@cameras.{name}={name}" for name in names if name not in OF_CONFIG]
    request = PairRequest(dataset, scenes=scenes or None, overrides=(*OWN, *chosen, *overrides))
    found = sources(request)
    for source in families(found):
        checked_chain(source)
    return Asked(tuple(found), names, shots)


def scored(asked: Asked, version: str = STORED) -> list[dict[str, Values]]:
    """Return {camera: {terms: {score: value}}} of each scene. Stored scores are read, so an
    interrupted study continues where it stopped.

    Parameters
    ----------
    asked : scenes and shots.
    version : version of the radiance.

    Raises
    ------
    CatalogError : scores cannot be written.
    """
    checked_version(version)
    found = []
    started = time.monotonic()
    computed = 0
    for place, source in enumerate(asked.sources, 1):
        if place == 1:
            made_with = identity_of(checked_chain(source))
        name = store.content_hash([source.store, source.overrides, asked.shots, version, made_with])
        path = home() / "questions" / "dirt" / f"{name}.json"
        line = f"scene {source.name}, {place} of {len(asked.sources)}, radiance {version}: "
        if path.exists():
            found.append(json.loads(path.read_text(encoding="utf-8")))
            print(line + "scored before")
            continue
        begun = time.monotonic()
        found.append(term_scores(source, version, asked.shots))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, json.dumps(found[-1]))
        except OSError as err:
            raise CatalogError(
                f"cannot write {path}: {err.strerror or err}; scenes that are scored are kept; make"
                " room and type the same command again"
            ) from err
        computed += 1
        left = len(asked.sources) - place
        rate_s = (time.monotonic() - started) / computed
        rest = f", about {duration(rate_s * left)} left" if left else ""
        print(line + f"{time.monotonic() - begun:.0f} s{rest}")
    return found


def identity_of(chain: Chain) -> dict[str, Any]:
    """Return all that can change the scores of a scene, except for its light and its overrides:
    fields, code, libraries and input files of the components.

    The fields are listed because the overrides only name presets and main config, which can change.

    Parameters
    ----------
    chain : components of one of the scenes.
    """
    components = chain.components()
    of_scene = (chain.scene, chain.renderer, chain.lighting)
    shared = [one for one in components if not any(one is other for other in of_scene)]
    return {
        "fields": [described(one) for one in shared],
        "cameras": list(chain.cameras),
        "code": fingerprint(*components, frame=True),
        "libraries": libraries(*components, frame=True),
        "inputs": input_digests(*shared),
    }


def rows_of(asked: Asked, scenes: Sequence[dict[str, Values]]) -> list[dict[str, Any]]:
    """Return the rows of the study.

    Parameters
    ----------
    asked : scenes and cameras.
    scenes : their scores, in the same order.
    """
    roads = [source.road or source.name for source in asked.sources]
    rows = []
    for camera in asked.cameras:
        for score in SCORES:
            of_scenes = [losses(one[camera], score) for one in scenes]
            wholes = [one["all"] for one in of_scenes]
            for term in TERMS:
                means = {
                    name: mean_over_roads([one[f"{name} {term}"] for one in of_scenes], roads)
                    for name in ("first", "last", "shapley")
                }
                share = ratio_over_roads(
                    [one[f"shapley {term}"] for one in of_scenes], wholes, roads
                )
                row: dict[str, Any] = {"camera": camera, "score": score, "term": term}
                row |= columns("loss", mean_over_roads(wholes, roads))
                for name, mean in means.items():
                    row |= columns(name, mean)
                row |= columns("share", share)
                counted = means["last"]
                rows.append(row | {"scenes": counted.count, "roads": counted.roads})
    return rows


def losses(values: Values, score: str) -> dict[str, float]:
    """Return the loss of a score in one scene: that of all terms, and that of each term by each
    rule.

    Parameters
    ----------
    values : scores of the scene with each set of terms.
    score : name of the score.
    """
    sign = -SCORES[score]
    of_subsets = {subset: sign * _number(values[key_of(subset)][score]) for subset in SUBSETS}
    every = frozenset(TERMS)
    found = {"all": of_subsets[every] - of_subsets[frozenset()]}
    for term, share in shares(of_subsets, TERMS).items():
        found |= {
            f"first {term}": share.first,
            f"last {term}": share.last,
            f"shapley {term}": share.shapley,
        }
    return found


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def text_of(rows: Sequence[dict[str, Any]], asked: Asked) -> str:
    """Return the tables as a page in Markdown.

    Parameters
    ----------
    rows : rows of the study.
    asked : scenes and cameras of the study.
    """
    lines = []
    for camera in asked.cameras:
        own = [row for row in rows if row["camera"] == camera]
        roads = max(row["roads"] for row in own)
        scenes = number_of(len(asked.sources), "scene")
        lines += [f"## {camera}: {scenes}, {number_of(roads, 'road')}", ""]
        table = [
            [
                row["score"],
                row["term"],
                *(shown(row, name) for name in ("loss", "first", "last", "shapley", "share")),
            ]
            for row in own
        ]
        head = ["score", "term", "loss, all terms", "first", "last", "Shapley", "share"]
        lines += [markdown_table(head, table)]
    return "\n".join(lines)
