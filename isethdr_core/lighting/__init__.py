"""Lighting: how much of each light group is in the picture.

| module       | what                                                             |
|--------------|------------------------------------------------------------------|
| `iset_rules` | the ISETHDR paper's rules for weights                            |
| `limits`     | ranges of the fields of lightings                                |
| `mix`        | the weighted sum of light groups, and their luminance maps       |
| `modulation` | how light groups vary in time: the config's table, checked       |
| `solver`     | weights from luminance maps, one unknown at a time               |
| `target`     | one photometric target: a statistic of a group and its luminance |
| `targets`    | lighting whose weights are solved from photometric targets       |
| `weights`    | lighting whose weights are known beforehand                      |
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
