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

from ..plugins.component import Component, class_getter

COMPONENTS = [
    Component("lighting", "weights", "isethdr_core.lighting.weights:WeightsLighting"),
    Component("lighting", "ideal", "isethdr_core.lighting.weights:IdealLighting"),
    Component("lighting", "targets", "isethdr_core.lighting.targets:TargetsLighting"),
    Component("lighting", "iset", "isethdr_core.lighting.iset_rules:IsetLighting"),
]
__getattr__ = class_getter(__name__, COMPONENTS)
