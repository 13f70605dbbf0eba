"""Signal plan: states of the traffic lights of a crossing over time.

Two groups of roads take turns: green, amber, red for both while the crossing empties, then red and
amber together before the next green. A group shows green or amber only while the other shows red.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ..placing.street_lights import Signals

# ranges of the durations, s, of fixed-time control at 50 km/h; the values are assumptions
GREEN_S = (12.0, 30.0)  # drawn for each group
AMBER_S = (3.0, 4.0)
CLEARANCE_S = (1.0, 2.0)  # red for both groups
RED_AMBER_S = (1.0, 1.5)
# states of the (first, second) group; in the other half of the cycle the groups change places
HALF = (("green", "red"), ("amber", "red"), ("red", "red"), ("red", "red_amber"))
PHASES = (*HALF, *((second, first) for first, second in HALF))


@dataclass(frozen=True)
class SignalPlan:
    """States of the signals of a crossing over time.

    Parameters
    ----------
    first, second : names of the roads of each group.
    lengths_s : durations of the eight `PHASES`, s.
    start_s : second of the cycle at time 0.
    """

    first: frozenset[str]
    second: frozenset[str]
    lengths_s: tuple[float, ...]
    start_s: float

    @property
    def cycle_s(self) -> float:
        """Period after which the states repeat, s."""
        return sum(self.lengths_s)

    def state(self, road: str, time_s: float) -> str:
        """Return what a road's signal shows: green, amber, red or red_amber; "" without a signal.

        Parameters
        ----------
        road : name of the road that meets the signal.
        time_s : time since the layout as placed, s.
        """
        if road not in self.first | self.second:
            return ""
        ends = list(accumulate(self.lengths_s))
        at = (self.start_s + time_s) % ends[-1]
        shown = PHASES[min(bisect_right(ends, at), len(PHASES) - 1)]
        return shown[0] if road in self.first else shown[1]


def signal_plan(signals: Signals) -> SignalPlan:
    """Return a plan with the states of a layout's signals at time 0.

    Parameters
    ----------
    signals : states at time 0 by road, of which one group is red; and the seed of all durations.
    """
    rng = np.random.default_rng(signals.seed)
    draw = lambda limits: float(rng.uniform(*limits))
    between = (draw(AMBER_S), draw(CLEARANCE_S), draw(RED_AMBER_S))
    lengths = (draw(GREEN_S), *between, draw(GREEN_S), *between)
    shown = {state for state in signals.state.values() if state != "red"}
    phase = 1 if "amber" in shown else 0
    start = sum(lengths[:phase]) + float(rng.uniform(0, lengths[phase]))
    return SignalPlan(frozenset(signals.state) - signals.red, signals.red, lengths, start)
