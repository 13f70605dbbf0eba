"""Lighting: how much of each light group is in the picture.

| module       | what                                                                   |
|--------------|------------------------------------------------------------------------|
| `iset_rules` | the ISETHDR paper's way to weights: lamps by their maximum             |
| `limits`     | ranges of the fields of lightings                                      |
| `mix`        | the weighted sum of light groups, and their luminance maps             |
| `modulation` | the config's table, checked, with phases drawn from their ranges       |
| `solver`     | one unknown at a time, each by a monotone search                       |
| `target`     | which statistic of a light group shall reach which luminance           |
| `targets`    | luminances per group, a dynamic range, a median or mean of the picture |
| `weights`    | lighting whose weights are known beforehand                            |
"""

from __future__ import annotations

from .iset_rules import IsetLighting
from .targets import TargetsLighting
from .weights import IdealLighting, WeightsLighting

COMPONENTS = [
    ("weights", WeightsLighting),
    ("ideal", IdealLighting),
    ("targets", TargetsLighting),
    ("iset", IsetLighting),
]
