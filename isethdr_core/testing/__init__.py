"""Conformance kit: one line in a plugin's tests checks all that the component's kind promises.

    from isethdr_core.testing import check
    def test_acme_nano(): check("sensor", "acme_nano", exposure_s=0.01)

A broken promise is an AssertionError that names the component and the promise. Inputs are small and made here.

| module     | what it checks                                                                                  |
|------------|-------------------------------------------------------------------------------------------------|
| `promise`  | how a promise is stated; those that every kind shares                                           |
| `ranges`   | fields refuse NaN, undeclared infinity, fractions of whole numbers, values outside their range  |
| `inputs`   | the small inputs: scenes, radiance, irradiance, captures, pictures, and their damaged versions  |
| `lazy`     | values that nobody may read before the form was checked; data read piece by piece from a store  |
| `scene`    | a description that a renderer can use, or valid radiance                                        |
| `renderer` | what was demanded comes back; a uniform sky looks like one; light is linear in the lamps        |
| `lighting` | the mix is the weighted sum that its weights state                                              |
| `lens`     | linear, energy, orientation, bands apart, ideal limit on a uniform field                        |
| `flare`    | an aperture takes light away, scatter conserves it, added light is linear                       |
| `sensor`   | expected electrons are dark charge plus light; noise is keyed by the pixel and agrees with expectation |
| `counting` | expected electrons, filter map and scatter of shots, computed from what the captures state       |
| `isp`      | a grey field comes back in cd/m2; estimates are not clipped; saturated pixels are not valid     |
| `isp_readings` | every number of the captures is read; places and colours stay; variance is that of pictures |
| `metric`   | finite scores from the labels it asked for, and for a perfect picture                           |
"""

from __future__ import annotations

import importlib

from ..component import KINDS
from ..errors import ConfigError, did_you_mean


def check(kind: str, name: str, /, **fields) -> None:
    """Check that the component `kind/name`, built with `fields`, keeps every promise of its kind.

    Raises
    ------
    AssertionError : the first broken promise, with the component's name.
    ConfigError : no such kind, name or field.
    """
    from ..registry import build
    from .promise import check_component

    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r}{did_you_mean(kind, KINDS)}")
    component, who = build(kind, name, **fields), f"{kind} {name!r}"
    check_component(who, kind, name, component, fields)
    importlib.import_module(f".{kind}", __name__).check(who, component)
