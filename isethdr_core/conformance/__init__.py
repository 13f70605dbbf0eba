"""Conformance kit: one line in a plugin's tests checks all that the component's kind promises.

| module         | what                                                                           |
|----------------|--------------------------------------------------------------------------------|
| `counting`     | what a sensor's captures state                                                 |
| `flare`        | an aperture takes light away, scatter is a probability                         |
| `inputs`       | small inputs for the conformance kit, made from formulas                       |
| `isp`          | absolute luminance from captures alone, estimates that are not clipped         |
| `isp_readings` | whether an isp reads captures as they say, keeps places and colours            |
| `lazy`         | sealed ones, which nobody may read, and those of a store                       |
| `lens`         | linear, bands apart, no light made, right way up                               |
| `lighting`     | the mix is the weighted sum of the groups, with the weights it states          |
| `metric`       | scores from the labels it asked for, finite where the picture is good          |
| `promise`      | how a promise is stated and checked                                            |
| `ranges`       | NaN, infinity, fractions, values outside a range                               |
| `renderer`     | what was demanded, a sky that is uniform, lamps of the stated candela          |
| `scene`        | a description that a renderer can use, or scene radiance that is already known |
| `sensor`       | expected electrons linear in light, noise keyed by pixel                       |

    from isethdr_core.testing import check
    def test_acme_nano(): check("sensor", "acme_nano", exposure_s=0.01)

A broken promise is an AssertionError that names the component and the promise. Inputs are small and
made here.
"""

from __future__ import annotations

import importlib

from ..errors import ConfigError, did_you_mean
from ..plugins.component import KINDS


def check(kind: str, name: str, /, **fields) -> None:
    """Check that the component `kind/name`, built with `fields`, keeps every promise of its kind.

    Raises
    ------
    AssertionError : the first broken promise, with the component's name.
    ConfigError : no such kind, name or field.
    """
    from ..plugins.registry import build
    from .promise import check_component

    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r}{did_you_mean(kind, KINDS)}")
    component, who = build(kind, name, **fields), f"{kind} {name!r}"
    check_component(who, kind, name, component, fields)
    importlib.import_module(f".{kind}", __name__).check(who, component)
