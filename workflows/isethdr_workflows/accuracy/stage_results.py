"""Stage results: a part of the chain, run stage by stage, with the CPU seconds of the stages."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from isethdr_core.data.reference_picture import labels_on, truth
from isethdr_core.data.scores import Score
from isethdr_core.pipeline.chain import imaging_plan, plan
from isethdr_core.pipeline.imaging_plan import TrivialPlan, imaged
from isethdr_core.pipeline.shot import developed
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.runs.seeds import generator
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import Quantity
from isethdr_core.uncertainty.ledger import Ledger

from ..empty_home import empty_home
from .configured_knobs import Setting

STAGES = ("scene", "lighting", "lens", "sensor", "isp", "metric")
FIRST = {"scene": 0, "renderer": 0, "lighting": 1, "lens": 2, "flare": 2, "sensor": 3, "isp": 4}
LAST = {
    Quantity.RADIANCE: 0,
    Quantity.IRRADIANCE: 2,
    Quantity.PHOTOCURRENT: 2,
    Quantity.ELECTRONS: 3,
    Quantity.PICTURE: 4,
    Quantity.SCORE: 5,
}
SENSOR = 3
ISP = 4
METRIC = 5


@dataclass(frozen=True, eq=False)
class Results:
    """The results of the stages of one configuration; None or empty for stages that were
    not run.
    """

    scene: Any = None  # scene radiance
    mixed: Any = None
    light: Any = None  # irradiance or photocurrent
    electrons: dict[str, Any] = field(default_factory=dict)  # {camera: mean electrons}
    captures: dict[str, Any] = field(default_factory=dict)
    pictures: dict[str, Any] = field(default_factory=dict)
    scores: dict[str, list[Score]] = field(default_factory=dict)


class Measured(NamedTuple):
    """Results, and the CPU seconds of the stages that were measured."""

    results: Results
    first_s: float  # CPU time of a first run, without stored results
    again_s: float  # CPU time of a second run directly after it; NaN if there was only one run


def span(kind: str, error_of: Quantity) -> tuple[int, int]:
    """Return the numbers of the first and the last stage that are run for a knob.

    Parameters
    ----------
    kind : kind of the component that declares the knob.
    error_of : quantity in which the error of the knob is measured.
    """
    first = FIRST.get(kind, METRIC)
    return first, max(first, LAST.get(error_of, SENSOR))


def all_stages(
    configuration: Setting, earlier: Results, first: int, last: int, exact: bool
) -> Results:
    """Run the stages number `first` to `last`, and return the results of all stages so far.

    Parameters
    ----------
    configuration : the configuration.
    earlier : the results of the stages before `first`.
    first, last : numbers of the stages.
    exact : whether the lens leaves nothing out, and computes irradiance band by band.
    """
    chain = configuration.parts
    config = configuration.config
    rows = Ledger()
    demand = plan(chain, rows)
    results = earlier
    if first <= 0:
        scene = scene_radiance(chain, demand, rows, config)[0].load()
        results = replace(results, scene=scene)
    if first <= 1 <= last:
        with ledger.stage(rows, "lighting"):
            results = replace(results, mixed=chain.lighting(results.scene))
    if first <= 2 <= last:
        with ledger.stage(rows, "lens"):
            flares = tuple(chain.flares.values())
            plan_of_lens = (
                TrivialPlan(chain.lens, flares)
                if exact
                else imaging_plan(chain, results.mixed, demand)
            )
            results = replace(results, light=imaged(plan_of_lens, results.mixed))
    if first <= SENSOR <= last:
        with ledger.stage(rows, "sensor"):
            electrons = {k: s.expected(results.light) for k, s in chain.cameras.items()}
            results = replace(results, electrons=electrons)
    if first <= ISP <= last:
        results = _developed(configuration, results, rows, sensed=first <= SENSOR)
    if first <= METRIC <= last:
        with ledger.stage(rows, "metric"):
            results = replace(results, scores=_scores(configuration, results))
    return results


def captured(configuration: Setting, earlier: Results) -> dict[str, Any]:
    """Return {camera: captures} of the light, with the noise of the configuration."""
    config = configuration.config
    random = generator(config.seed, config.device, config.scene.name)
    with ledger.stage(Ledger(), "sensor"):
        return {
            k: sensor(earlier.light, random) for k, sensor in configuration.parts.cameras.items()
        }


def measured(
    configuration: Setting, earlier: Results, first: int, last: int, exact: bool
) -> Measured:
    """Run some stages; return the results and their CPU seconds. The following stages up to the
    electrons are run as well, but not timed.

    Parameters
    ----------
    configuration : configuration to measure.
    earlier : results of the stages before `first`.
    first, last : numbers of the first and of the last stage that is measured.
    exact : whether the lens leaves nothing out, and computes irradiance band by band.
    """
    # a second rendering would only read the stored result of the first
    once = first == 0 and configuration.parts.renderer is not None
    # an empty home, so that no stored radiance and no kernels are found
    alone = empty_home() if first in (0, 2) else nullcontext()
    with alone:
        start = time.process_time()
        results = all_stages(configuration, earlier, first, last, exact)
        middle = time.process_time()
        if not once:
            all_stages(configuration, earlier, first, last, exact)
        again_s = float("nan") if once else time.process_time() - middle
    if last < SENSOR:
        results = all_stages(configuration, results, last + 1, SENSOR, exact)
    return Measured(results, middle - start, again_s)


def _developed(configuration: Setting, earlier: Results, rows: Ledger, sensed: bool) -> Results:
    captures = (
        captured(configuration, earlier) if sensed or not earlier.captures else earlier.captures
    )
    with ledger.stage(rows, "isp"):
        pictures = {k: developed(configuration.parts.isp, c) for k, c in captures.items()}
    return replace(earlier, captures=captures, pictures=pictures)


def _scores(configuration: Setting, results: Results) -> dict[str, list[Score]]:
    scores = {}
    for name, picture in results.pictures.items():
        reference = truth(results.mixed, picture)
        labels = labels_on(results.scene, picture)
        metrics = configuration.parts.metrics.values()
        scores[name] = [score for m in metrics for score in m(picture, reference, labels)]
    return scores
