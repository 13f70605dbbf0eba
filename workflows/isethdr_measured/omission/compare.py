"""Both runs of a case: their work, the largest difference of their readings, and the difference
allowed. The runs alternate, and each starts with an empty home folder.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics.psf.error_parts import KERNELS
from isethdr_workflows.empty_home import empty_home

from isethdr_core import compose, run
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline import runtime_estimate
from isethdr_core.pipeline.bands import BANDS
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.runs import radiance_cache
from isethdr_core.runs import run as runs

from .cases import BY_GROUP, CHART, CLEAN, SHARP, TILES

if TYPE_CHECKING:
    from omegaconf import DictConfig

# relative error of rounding irradiance, and the quantities computed from it, to float32
FLOAT32 = 2.0**-22
# number of runs of each kind, by whether the case is rendered; the first run enlarges the memory of
# the process, and the times of short runs scatter by a fifth
TURNS = {True: 2, False: 5}
NOISE_SD = "standard deviations of the sensor's noise"


def compared(name: str, case: Any, turns: int | None = None) -> dict:
    """Return the row of one case. Both runs alternate. The least CPU time of each counts, because
    the load of the machine only adds to it.

    Parameters
    ----------
    name : name of the case.
    case : overrides of the configuration, and whether it is rendered.
    turns : number of runs of each kind; None takes it from `TURNS`.
    """
    config = compose(list(case.overrides))
    whole = compose([*case.overrides, "leave_out=false"])
    with empty_home():
        planned_rows, plan_s = measured(lambda: planned(config))
    pairs = [(fresh(config), fresh(whole)) for _ in range(turns or TURNS[case.rendered])]
    few_s = min(spent_s for (_, spent_s), _ in pairs)
    every_s = min(spent_s for _, (_, spent_s) in pairs)
    (few, _), (every, _) = pairs[0]
    difference, bound = largest(few, every)
    return {
        "case": name,
        "left out": "; ".join(
            dict.fromkeys(
                o.what
                for row in (*planned_rows, *few["ledger"])
                for o in row.left_out
                if o.needless
            )
        ),
        "cpu_s": few_s,
        "everything_cpu_s": every_s,
        "ratio": every_s / few_s,
        "plan_percent": 100 * plan_s / every_s,
        "difference_e": difference,
        "bound_e": bound,
        "agree": difference <= bound,
    }


def fresh(config: DictConfig) -> tuple[dict, float]:
    """Return (readings of a run in an empty home, CPU seconds of the run)."""
    with empty_home():
        result, spent_s = measured(lambda: run(config))
        return readings_of(result), spent_s


def measured(work: Any) -> tuple[Any, float]:
    """Return (result of `work`, CPU seconds of all threads)."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def planned(config: DictConfig) -> Ledger:
    """Return the ledger of a plan. The plan is made from the config as by `isethdr plan`, including
    the search for stored results.
    """
    rows = Ledger()
    built = chain(config)
    demand = plan(built, rows)
    runs.run_key(config, built)
    runtime_estimate.expected_s(
        built, runs.plain(config), radiance_cache.held_and_missing(built, demand)[1]
    )
    return rows


def readings_of(result: Any) -> dict:
    """Return the readings of a finished run: captures in electrons, their noise, and the ledger."""
    [camera] = result.cameras
    captures = result.open(f"captures/{camera}").load()
    gain, black = (captures[name].values[:, None, None] for name in ("gain_dn_per_e", "black_dn"))
    electrons = (captures["raw"].values.astype(float) - black) / gain
    whole = np.issubdtype(captures["raw"].dtype, np.integer)
    noise_e = np.sqrt(
        captures["read_noise_e"].values[:, None, None] ** 2 + np.maximum(electrons, 0.0)
    )
    return {
        "electrons": electrons,
        "noise_e": noise_e,
        "step_e": whole / gain,
        "ledger": result.ledger,
        "scores": [(s["metric"], s["object"], s["value"]) for s in result.scores],
        "noisy": bool(captures["read_noise_e"].values.any()),
    }


def largest(few: dict, every: dict) -> tuple[float, float]:
    """Return the difference of the reading that comes nearest to its bound or exceeds it most, and
    that bound, in electrons.

    Light may differ by the bound of the ledger: the lens's error in standard deviations of noise,
    the omitted bands, rounding; and, if the runs used kernels of different accuracy, the errors of
    both. A reading may differ by twice this bound, because a photon count
    changes by at most twice the change of its mean. If light differs at all, one electron and one
    code more are allowed, because counts and codes are whole numbers.

    Parameters
    ----------
    few : readings of the run with omissions.
    every : readings of the run that computes everything.
    """
    difference = np.abs(few["electrons"] - every["electrons"])
    sd = sum(
        error.value
        for row in few["ledger"]
        for error in row.errors
        if error.source.kind == "lens" and error.unit == NOISE_SD
    )
    bands = sum(
        o.bound for row in few["ledger"] for o in row.left_out if o.needless and o.key == BANDS
    )
    light = (
        sd * every["noise_e"]
        + (bands + FLOAT32 * bool(bands or sd)) * np.abs(every["electrons"]).max()
        + _of_kernels(few["ledger"], every["ledger"]) * np.abs(every["electrons"])
    )
    bound = 2 * light + (light > 0) * (every["step_e"] + every["noisy"])
    worst = np.unravel_index(np.argmax(difference - bound), difference.shape)
    return float(difference[worst]), float(bound[worst])


def _of_kernels(few: Ledger, every: Ledger) -> float:
    """Return by how much the spread light of two runs may differ, as a share of that light.

    If both runs state the same errors of their kernels, they used the same kernels, and the result
    is 0. Otherwise it is the sum of the largest kernel error of each run. Near lamps, a run that
    knows its cameras may compute finer kernels than one that does not.
    """
    errors_of = [
        [error.value for row in rows for error in row.errors if error.source.key in KERNELS]
        for rows in (few, every)
    ]
    if errors_of[0] == errors_of[1]:
        return 0.0
    return sum(max(values, default=0.0) for values in errors_of)


def warmed(rendered: Any = ()) -> None:
    """Run a small chart once, and each case of `rendered` with two paths per tile, both with and
    without omissions. No measured run then includes imports or compilation.

    Code is compiled once per machine, so otherwise the first run would take longer.
    """
    with empty_home():
        run(
            compose(
                [
                    "scene=macbeth",
                    *CHART,
                    *CLEAN,
                    "sensor=lofic",
                    "scene.width=24",
                    "scene.height=16",
                ]
            )
        )
    for case in rendered:
        settings = [o for o in case.overrides if o not in (*SHARP, *TILES, *BY_GROUP)]
        for more in ([], ["leave_out=false"]):
            with empty_home():
                run(
                    compose(
                        [
                            *settings,
                            *SHARP,
                            "renderer.width=64",
                            "renderer.height=36",
                            "renderer.samples=2",
                            *more,
                        ]
                    )
                )
