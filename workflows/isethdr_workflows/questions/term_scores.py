"""Scores of a scene with each set of terms switched on: scatter, ghosts and noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from isethdr_catalog.dataset import is_thing
from isethdr_sensors.imaging_sensor import ImagingSensor

from isethdr_core.data.derived_once import shared, values_only
from isethdr_core.data.reference_picture import labels_on, truth
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import Chain
from isethdr_core.pipeline.shot import developed
from isethdr_core.runs.seeds import Generator
from isethdr_core.uncertainty.ledger import collected

from ..dataset.pairs.exposures import at_one_exposure
from ..dataset.pairs.making import Imaged, built_for, light_of, shot_key
from ..dataset.pairs.sources import Source
from ..dataset.pairs.terms import Member, check_added, spreads
from ..dataset.study.tables import DETECTION, name_of
from .radiance_versions import STORED, RadianceVersion

TERMS = ("scatter", "ghosts", "noise")
# factor on the stated variance of pictures without noise, as with a million times as many electrons
NOISELESS = 1e-6
# {score: 1 if larger is better, -1 if smaller is better}
SCORES = {
    "detection of objects": 1,
    "ssim": 1,
    "ciede2000": -1,
    "log_luminance_error": -1,
    "dynamic_range": 1,
}
NEED_NOISE = ("dynamic_range",)  # scores that are not defined without noise
SUBSETS = [
    frozenset(chosen) for count in range(len(TERMS) + 1) for chosen in combinations(TERMS, count)
]
Values = dict[str, dict[str, float]]  # {terms switched on, joined by +: {score: value}}


def key_of(subset: frozenset[str]) -> str:
    """Return the name of a set of terms."""
    return "+".join(term for term in TERMS if term in subset)


def checked_chain(source: Source) -> Chain:
    """Return the chain of a scene, and check that it has both kinds of flares, and cameras with
    noise that can be switched off.

    Raises
    ------
    ConfigError : the chain has no flare that spreads light, none that adds light, or a camera
        without the field `noise`.
    """
    built = built_for(source)[1]
    for sensor in built.cameras.values():
        _with_noise(sensor)
    kinds = {spreads(flare) for flare in built.flares.values()}
    if kinds != {True, False}:
        lacking = "spreads light" if True not in kinds else "adds light"
        raise ConfigError(
            f"the chain has no flare that {lacking}, so its share is not known; expected dirt and"
            " ghosts; type for example +flare@flare.ghosts=ghosts_broadband"
        )
    check_added(built, built.scene())
    return built


def _with_noise(sensor: Any) -> ImagingSensor:
    """Return a sensor; raise ConfigError if its noise cannot be switched off."""
    if not isinstance(sensor, ImagingSensor):
        raise ConfigError(
            f"the noise of {type(sensor).__name__} cannot be switched off; expected a sensor with"
            " the field noise; type for example cameras=bayer"
        )
    return sensor


def term_scores(source: Source, version: str = STORED, shots: int = 1) -> dict[str, Values]:
    """Return {camera: {terms: {score: value}}} of a scene.

    All members have the exposure that automatic exposure finds with all terms.

    Parameters
    ----------
    source : the scene.
    version : name of the version of its radiance.
    shots : number of noise realisations over which noisy scores are averaged.
    """
    config, built = built_for(source)
    if version != STORED:
        built = replace(built, scene=RadianceVersion(built.scene, version))
    spread = {name: flare for name, flare in built.flares.items() if spreads(flare)}
    added = {name: flare for name, flare in built.flares.items() if not spreads(flare)}
    members = [
        Member("", "", built.lens, {}),
        Member("scatter", "", built.lens, spread),
        Member("ghosts", "", built.lens, added),
    ]
    seen = light_of(config, built, members, source)
    light = seen.light
    # Dirt does not change ghosts. If all light has the same grid, the light with both is a sum, and
    # the lens need not be computed a fourth time.
    if all(one.dims == light[""].dims and one.shape == light[""].shape for one in light.values()):
        values = light["scatter"].values + (light["ghosts"].values - light[""].values)
        light["scatter+ghosts"] = light["scatter"].copy(data=np.maximum(values, 0.0))
    else:
        both = Member("scatter+ghosts", "", built.lens, built.flares)
        light |= light_of(config, built, [both], source).light
    return {
        name: of_camera(seen, sensor, [shot_key(seen.key, k) for k in range(shots)])
        for name, sensor in built.cameras.items()
    }


def of_camera(seen: Imaged, sensor: Any, keys: Sequence[Generator]) -> Values:
    """Return {terms: {score: value}} of one camera.

    Parameters
    ----------
    seen : the light of the members: "", "scatter", "ghosts", "scatter+ghosts".
    sensor : sensor of the camera.
    keys : keys of the noise of each shot.
    """
    fixed = _with_noise(at_one_exposure(sensor, seen.light["scatter+ghosts"]))
    silent = replace(fixed, noise=False)

    def pictured(subset: frozenset[str]) -> list[Any]:
        light = seen.light[key_of(subset - {"noise"})]
        taken = fixed if "noise" in subset else silent
        return [
            collected(lambda one=key: developed(seen.chain.isp, taken(light, one))).result
            for key in (keys if "noise" in subset else keys[:1])
        ]

    first = pictured(SUBSETS[0])
    compared = compared_with(seen, first[0])  # all pictures have the same pixels
    found: Values = {}
    with shared(compared.reference, compared.labels), values_only():
        for subset in SUBSETS:
            pictures = pictured(subset) if subset else first
            scored = [scores_of(seen, one, "noise" in subset, compared) for one in pictures]
            found[key_of(subset)] = {
                name: float(np.mean([one[name] for one in scored])) for name in SCORES
            }
    return found


class Compared(NamedTuple):
    """The data with which the pictures of one camera are compared."""

    reference: Any  # reference picture
    labels: Any  # labels on the same pixels
    things: frozenset[str]  # names of the objects that count


def compared_with(seen: Imaged, picture: Any) -> Compared:
    """Return reference picture and labels on the pixels of a picture.

    Parameters
    ----------
    seen : scene as the lens images it.
    picture : a picture of the camera.
    """
    reference = collected(lambda: truth(seen.mixed, picture)).result
    labels = labels_on(seen.scene, picture)
    things = (name_of(r) for r in labels.attrs["objects"] if is_thing(r["category"]))
    return Compared(reference, labels, frozenset(things))


def scores_of(seen: Imaged, picture: Any, noisy: bool, compared: Compared) -> dict[str, float]:
    """Return the scores of a picture; NaN if it has no such score.

    Parameters
    ----------
    seen : scene as the lens images it, with the components of the run.
    picture : picture of a camera.
    noisy : whether the picture has noise; otherwise scores that need noise are NaN.
    compared : reference picture, labels, and names of the objects that count.
    """
    if not noisy:
        names = [name for name in picture.data_vars if "variance" in str(name)]
        picture = picture.assign({name: picture[name] * NOISELESS for name in names})

    def scored() -> list[Score]:
        metrics = seen.chain.metrics.values()
        reference = compared.reference
        labels = compared.labels
        return [score for metric in metrics for score in metric(picture, reference, labels)]

    scores = collected(scored).result
    frame = {score.metric: score.value for score in scores if not score.object}
    things = compared.things
    objects = [score.value for score in scores if score.metric == DETECTION and _is(score, things)]
    values = {name: float(frame.get(name, math.nan)) for name in SCORES}
    values["detection of objects"] = float(np.mean(objects)) if objects else math.nan
    if not noisy:
        values |= dict.fromkeys(NEED_NOISE, math.nan)
    return values


def _is(score: Score, things: frozenset[str]) -> bool:
    """Return whether a score belongs to one of the things. Metrics append a number to names that
    occur more than once.
    """
    return score.object in things or score.object.rpartition(" ")[0] in things
