"""Lighting: the weight of each light group in the picture.

| module       | content                                                          |
|--------------|------------------------------------------------------------------|
| `iset_rules` | the ISETHDR paper's rules for weights                            |
| `limits`     | ranges of the fields of lightings                                |
| `mix`        | the weighted sum of light groups, and their luminance maps       |
| `modulation` | temporal modulation of light groups: the config's table, checked |
| `solver`     | weights from luminance maps, one unknown at a time               |
| `target`     | one photometric target: a statistic of a group and its luminance |
| `targets`    | lighting whose weights are solved from photometric targets       |
| `weights`    | lighting with given weights                                      |
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
