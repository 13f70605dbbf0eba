"""Rules that merge captures, over eight decades of light."""

from __future__ import annotations

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core.plugins.registry import build

from ..merge_rules import default_levels, judged, near_top, rules, shot

DRAWS = 40000


def measured() -> list[Work]:
    """Return one diagram: excess of a rule's rms error over that of the best rule. It is the mean
    over all levels from 1 e that are not near the end of a capture.
    """
    model = build("sensor", "split_pixel").model()
    rng = np.random.default_rng(1)
    default = build("isp", "merge").rule
    levels = [level for level in default_levels(model) if level >= 1 and not near_top(model, level)]
    shots = [(level, *shot(model, level, DRAWS, rng)) for level in levels]
    snr_of = {}
    cost = {}
    for name, rule in rules().items():
        merged, cpu_s, peak_mb = timed(
            lambda rule=rule: [rule(groups, per_light) for _, groups, per_light, _ in shots]
        )
        snr_of[name] = np.array(
            [
                judged(m, controls, level)["snr_db"]
                for m, (level, _, _, controls) in zip(merged, shots)
            ]
        )
        cost[name] = cpu_s, peak_mb
    best = np.max(list(snr_of.values()), axis=0)
    mark = {default: "default", "average": "peer", "isetcam": "peer"}
    points = [
        Point(name, float(np.mean(10 ** ((best - snr) / 20) - 1)), *cost[name], mark.get(name, ""))
        for name, snr in snr_of.items()
    ]
    return [
        Work(
            "merge",
            "rms error above the best rule's, mean over levels",
            "the best of all rules at each level",
            1 / np.sqrt(2 * DRAWS),
            points,
        )
    ]
