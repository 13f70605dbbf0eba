"""Conformance kit: one line in a plugin's tests checks all that the component's kind promises.

| module         | content                                                                 |
|----------------|-------------------------------------------------------------------------|
| `counting`     | a sensor's stated electrons and noise against an independent count      |
| `flare`        | promises of a flare: an aperture removes light, scatter keeps energy    |
| `inputs`       | small inputs for the conformance kit, made from formulas                |
| `isp`          | promises of an isp: absolute luminance, unclipped estimates             |
| `isp_readings` | whether an isp reads captures as stated, and keeps places and colours   |
| `lazy`         | arrays that must not be read, and arrays that are read piece by piece   |
| `lens`         | promises of a lens: linear, independent bands, no gain, orientation     |
| `lighting`     | promises of a lighting: the mix is the weighted sum of the groups       |
| `metric`       | promises of a metric: finite scores from the labels it asked for        |
| `promise`      | how a promise is stated and checked                                     |
| `ranges`       | field values that a component must refuse: NaN, infinity, out of range  |
| `renderer`     | promises of a renderer: stated candela, light linear in the lamps       |
| `scene`        | promises of a scene: a usable description, or known scene radiance      |
| `sensor`       | promises of a sensor: electrons linear in light, noise keyed by pixel   |

    from isethdr_core.testing import check
    def test_acme_nano(): check("sensor", "acme_nano", exposure_s=0.01)

A broken promise is an AssertionError that names the component and the promise. Inputs are small and
made here.
"""

from __future__ import annotations

import importlib
from typing import Any

from ..errors import ConfigError, did_you_mean
from ..plugins.component import KINDS
from ..plugins.registry import build


def check(kind: str, name: str, /, **fields: Any) -> None:
    """Check that a component keeps every promise of its kind.

    Parameters
    ----------
    kind : kind of the component, for example `lens`.
    name : registered name of the component.
    fields : fields with which the component is built, by name.

    Raises
    ------
    AssertionError : the first broken promise, with the component's name.
    ConfigError : no such kind, name or field.
    """
    from .promise import check_component

    if kind not in KINDS:
        raise ConfigError(f"unknown kind {kind!r}{did_you_mean(kind, KINDS)}")
    component = build(kind, name, **fields)
    subject = f"{kind} {name!r}"
    check_component(subject, kind, name, component, fields)
    importlib.import_module(f".{kind}", __name__).check(subject, component)
