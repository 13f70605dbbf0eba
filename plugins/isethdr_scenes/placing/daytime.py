"""Lamps by day. Daytime running lamps replace dipped beams, position lamps and rear lamps.

UN R48, 6.19.7: daytime running lamps are on while the headlamps are off. Motorcycles keep their
dipped beam (UN R53 allows either).
"""

from __future__ import annotations

from dataclasses import replace

from .plan import Layout
from .site import Foot

WITH_DAYTIME = ("car", "truck", "bus")  # groups of vehicles with daytime running lamps
# lamps that are off by day; lit destination signs too, because 100 cd/m2 is not visible by day
OFF = ("position", "tail", "marker", "sign")
OFF_ON_BICYCLES = ("bike_front", "bike_tail")


def by_day(layout: Layout) -> Layout:
    """Return the layout with the lamps that are on by day.

    Brake lamps, indicators, and lamps of things that are not vehicles do not change.
    """
    standing = tuple(replace(one, foot=_by_day(one.foot)) for one in layout.standing)
    return replace(layout, standing=standing)


def _by_day(foot: Foot) -> Foot:
    if foot.thing.group == "bicycle":
        return replace(foot, lamps=tuple(k for k in foot.lamps if k not in OFF_ON_BICYCLES))
    if foot.thing.group not in WITH_DAYTIME:
        return foot
    lamps = ("daytime" if k == "low_beam" else k for k in foot.lamps if k not in OFF)
    return replace(foot, lamps=tuple(lamps))
