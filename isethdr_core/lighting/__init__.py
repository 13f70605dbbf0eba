"""Lighting: how much of each light group is in the picture.

| module       | what                                                                          |
|--------------|-------------------------------------------------------------------------------|
| `members`    | `weights` and `ideal`: weights that are known beforehand                      |
| `targets`    | `targets`: weights solved from luminances, a dynamic range, a median or mean  |
| `iset`       | `iset`: the weights of the ISETHDR paper's script, random draws included      |
| `target`     | one photometric target: its statistic, its luminance or seeded range          |
| `solve`      | weights from luminance maps                                                   |
| `mix`        | the weighted sum, group by group in blocks of bands; luminance maps           |
| `limits`     | ranges of the fields                                                          |
| `modulation` | how groups vary in time: the config's table, phases drawn from their ranges   |
"""

from __future__ import annotations

from .iset import IsetLighting
from .members import IdealLighting, WeightsLighting
from .targets import TargetsLighting

COMPONENTS = [
    ("weights", WeightsLighting),
    ("ideal", IdealLighting),
    ("targets", TargetsLighting),
    ("iset", IsetLighting),
]
