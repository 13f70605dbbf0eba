"""A plugin that ignores demands still works, only slower: whole runs with Acme's camera, as it is
and with a method `narrow`.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from omegaconf import open_dict

from isethdr_core import compose, run
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.uncertainty import ledger

from .command_line import EXAMPLE

JOB = [
    "scene=macbeth",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=4",
    "scene.last_nm=1000",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "~flare.dirt",
    "sensor=bayer",
    "lens=ideal",
    "isp=linear",
    "draws=2",
    "report=false",
    *(
        f"~metric.{name}"
        for name in (
            "shares",
            "dynamic_range",
            "snr",
            "ssim",
            "log_luminance",
            "contrast",
            "detection",
        )
    ),
]
NEGLIGIBLE = 1e-6


@pytest.fixture
def acme(offer, monkeypatch):
    """Offer Acme's sensor and lens, and return both classes."""
    monkeypatch.syspath_prepend(EXAMPLE)
    from acme_camera import AcmeNano, AcmePlastic

    offer("sensor", "acme_nano", AcmeNano)
    offer("lens", "acme_plastic", AcmePlastic)
    yield AcmeNano, AcmePlastic
    for name in [m for m in sys.modules if m.startswith("acme_camera")]:
        sys.modules.pop(name)


@cache
def composed():
    """Return the composed config, in which Acme's components replace bundled ones.

    Hydra cannot choose them, because config groups are fixed before a test can offer components.
    """
    config = compose(JOB)
    with open_dict(config):
        config.sensor = {"name": "acme_nano"}
        config.lens = {"name": "acme_plastic"}
    return config


def job(leave_out=True):
    config = composed().copy()
    config.leave_out = leave_out
    return config


def raw(result):
    return result.open("captures/acme_nano")["raw"].values.astype(float)


@pytest.mark.slow
def test_it_gets_all_there_is_and_makes_the_same_bits_as_where_nothing_may_be_left_out(acme):
    assert not any(
        hasattr(part, method)
        for part in acme
        for method in ("narrow", "photocurrent", "keeps_light")
    )
    rows = Ledger()
    demand = plan(chain(job()), rows)
    assert demand.wavelength_nm is None and demand.response is None and demand.margin
    few, every = (run(job(leave_out)) for leave_out in (True, False))
    np.testing.assert_array_equal(raw(few), raw(every))
    assert [s["value"] for s in few.scores] == [s["value"] for s in every.scores]
    assert len(few.open("captures/acme_nano").wavelength) == 61


@pytest.mark.slow
def test_taught_to_narrow_it_is_given_less_and_sees_the_same(acme, offer):
    slow = run(job())

    @dataclass(frozen=True)
    class Narrowing(acme[0]):
        """Acme's sensor that says which bands it sees."""

        def narrow(self, demand):
            """Return the demand without the bands in which all filters are blind."""
            nm = np.array(demand.wavelength_nm)
            seen = (
                np.max(
                    [np.exp(-0.5 * ((nm - peak) / 45.0) ** 2) for peak in (600.0, 540.0, 460.0)],
                    axis=0,
                )
                > NEGLIGIBLE
            )
            ledger.left_out(
                "bands that no filter passes",
                "quantum efficiency below 1e-6 of its peak",
                NEGLIGIBLE,
                "relative",
            )
            return replace(demand, wavelength_nm=tuple(nm[seen].tolist()))

    offer("sensor", "acme_nano", Narrowing)
    rows = Ledger()
    demand = plan(chain(job()), rows)
    assert demand.wavelength_nm[-1] == 830.0, (
        "45 nm x sqrt(2 ln 1e6) = 237 nm beyond the reddest peak"
    )
    [left] = [o for o in rows[0].left_out if "neither a sensor" in o.why]
    assert left.bound == NEGLIGIBLE and "17 of 61 bands" in left.what
    fast = run(job())
    assert fast.key != slow.key
    few = raw(fast)
    every = raw(slow)
    gain = float(fast.open("captures/acme_nano")["gain_dn_per_e"].values[0])
    # 17 bands of 1e-6 of the peak change a mean by far less than an electron. The count then
    # changes by one electron at most, and rounding by one code
    assert np.abs(few - every).max() <= gain + 1
    assert (few != every).mean() < 1e-3
