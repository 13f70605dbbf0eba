"""The error budget of a run: wrong values are refused with a hint, and right ones reach the
components.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from isethdr_core import AccuracyKnob, ErrorShare, compose
from isethdr_core.data.error_costs import STORE, STORE_COST, USUAL, Cost, divided
from isethdr_core.demand import Demand, Response
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import Chain, chain, on_sensor, plan
from isethdr_core.plugins import registry
from isethdr_core.plugins.component import Component
from isethdr_core.plugins.registry import build
from isethdr_core.storage.encoding import KEEPBITS, bits_for, rounding
from isethdr_core.uncertainty import budget, ledger, spending
from isethdr_core.uncertainty.error_terms import Quantity

SMALL = [
    "scene=uniform",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=4",  # makes the sensor small
    "~renderer",
    "lighting=ideal",
    "~versions",
    "lens=ideal",
    "~flare.dirt",
    "sensor=bayer",
]


@pytest.mark.parametrize("value", ["0", "-0.1", "1.5", "much", "true", "null"])
def test_a_share_of_the_noise_is_above_0(value):
    with pytest.raises(
        ConfigError,
        match=(
            r"accuracy.noise_fraction_allowed is .*above 0.*type"
            r" accuracy.noise_fraction_allowed=0.1"
        ),
    ):
        chain(compose([*SMALL, f"accuracy.noise_fraction_allowed={value}"]))


@pytest.mark.parametrize("value", ["0", "-1", "2"])
def test_so_is_the_noise_of_a_renderer(value):
    with pytest.raises(
        ConfigError,
        match=r"accuracy.render_error_allowed is .*above 0.*type accuracy.render_error_allowed=0.1",
    ):
        chain(compose([*SMALL, f"accuracy.render_error_allowed={value}"]))


def test_a_share_of_no_number_is_refused():
    for wrong in (float("nan"), inf, None, "0.1"):
        with pytest.raises(ConfigError, match="noise_fraction_allowed"):
            budget.allowed({"accuracy": {"noise_fraction_allowed": wrong}})
    assert budget.allowed({}) == budget.Allowed()  # earlier configs have no such node
    with pytest.raises(ConfigError, match="no key 'noise'"):
        budget.allowed({"accuracy": {"noise": 0.1}})
    with pytest.raises(ConfigError, match="accuracy is 0.05; .* accuracy.noise_fraction_allowed="):
        budget.allowed({"accuracy": 0.05})


def test_the_renderer_is_told_or_it_is_said_why_not():
    @dataclass(frozen=True)
    class Told:
        error_allowed: float | None = None

    @dataclass(frozen=True)
    class Untold:
        samples: int = 1

    given = budget.Allowed(render_error=0.2)
    assert (
        budget.renderer_with_error(Told(), given)
        == Told(0.2)
        == budget.renderer_with_error(Told(0.2), given)
    )
    assert budget.renderer_with_error(Untold(), budget.Allowed()) == Untold()
    for wrong, said in (
        (Untold(), "Untold has no field error_allowed"),
        (None, "no renderer"),
        (Told(0.3), "set one of them"),
    ):
        with pytest.raises(ConfigError, match=said):
            budget.renderer_with_error(wrong, given)


def test_the_error_allowed_is_that_of_the_largest_signal_to_noise_ratio():
    response = Response(
        ("G",),
        lambda nm: nm,
        1.0,
        read_noise_e=30.0,
        full_scale_e=10_000.0,
        noise_fraction_allowed=0.2,
    )
    assert response.error_allowed == pytest.approx(0.2 * sqrt(10_000 + 900) / 10_000, rel=1e-15)
    dark = replace(response, full_scale_e=2500.0)
    # the smaller error counts
    assert (
        response.error_allowed < dark.error_allowed
        and (response + dark).error_allowed == response.error_allowed
    )
    assert replace(response, full_scale_e=inf).error_allowed == 0.0


@pytest.mark.parametrize("allowed", [0.003, 0.1, 2.0])
@pytest.mark.parametrize(
    "costs",
    [
        {"a": Cost(1.0, 2.0), "b": Cost(30.0, 0.5)},
        {"a": Cost(0.2), "b": Cost(5.0, 1.0), "c": Cost(1.0, 3.0)},
        {"a": Cost(3.0), "b": Cost(1.0), "c": Cost(7.0)},
    ],
)
def test_no_other_division_costs_less(costs, allowed):
    errors = divided(allowed, costs)
    assert sum(errors.values()) == pytest.approx(allowed, rel=1e-12)
    least = sum(c.of(errors[k]) for k, c in costs.items())
    rng = np.random.default_rng(0)
    shares = np.arange(1, 200) / 200
    if len(costs) == 2:
        tried = np.stack([shares, 1 - shares], axis=1)
    else:
        tried = np.array([(a, b, 1 - a - b) for a in shares for b in shares if a + b < 0.999])
    found = min(
        sum(c.of(allowed * e) for c, e in zip(costs.values(), row))
        for row in [*tried, *rng.dirichlet(np.ones(len(costs)), 200).clip(1e-9)]
    )
    # the minimum over a grid is a little above the true minimum: in a cell of half a percent,
    # costs of power 3 change by 1.5 %
    assert least <= found * (1 + 1e-12) + 1e-12 and found - least < 0.03 * (
        abs(least) + sum(c.seconds for c in costs.values())
    )


def test_where_only_logarithms_are_paid_shares_are_as_the_seconds():
    errors = divided(0.1, {"a": Cost(3.0), "b": Cost(1.0)})
    assert errors["a"] == pytest.approx(0.075, rel=1e-12)


def test_a_store_keeps_the_bits_that_its_share_asks_for():
    for fraction in (0.3, 0.1, 0.01):
        demand = budget.budgeted(
            build("sensor", "bayer").narrow(Demand()), budget.Allowed(fraction)
        )
        error = budget.stored_error(demand)
        snr = demand.response.noise_fraction_allowed / demand.error_allowed
        # the share of the noise at full scale, where the signal-to-noise ratio is largest
        assert error * snr == pytest.approx(STORE * fraction, rel=1e-12)
        bits = bits_for(error)
        assert rounding(bits) <= error and (bits == KEEPBITS or rounding(bits - 1) > error)
    assert bits_for(0.0) == KEEPBITS and bits_for(1e-9) is None and bits_for(0.5) == KEEPBITS


def test_the_plan_passes_it_on():
    rows = ledger.Ledger()
    demand = plan(chain(compose([*SMALL, "accuracy.noise_fraction_allowed=0.5"])), rows)
    full_e = max(build("sensor", "bayer").full_scale_e())
    left = 0.5 * (1 - STORE)  # the store takes its share first
    assert (
        demand.response.noise_fraction_allowed == left
        and demand.error_allowed == demand.response.error_allowed
    )
    # 5 %: read noise is small compared with the shot noise of a full well
    assert demand.error_allowed == pytest.approx(left / sqrt(full_e), rel=0.05)
    assert any("0.5 of the noise" in e.label for e in rows[0].errors)
    # without noise, no error is allowed
    assert (
        plan(chain(compose([*SMALL, "sensor.noise=false"])), ledger.Ledger()).error_allowed == 0.0
    )


def test_only_a_lens_that_takes_an_error_is_told_one():
    mixed = build("lighting", "ideal")(build("scene", "uniform", width=6, height=4)())
    told = []
    for call in (
        lambda light, flares=(), error_allowed=0.0: told.append(error_allowed) or light,
        lambda light, flares=(): told.append("none") or light,
    ):
        lens = type("Lens", (), {"__call__": staticmethod(call)})()
        parts = Chain(None, None, None, {}, lens, {}, {"a": SimpleNamespace()}, None, {})
        on_sensor(parts, mixed, Demand(error_allowed=0.01))
    assert told == [0.01, "none"]


@dataclass(frozen=True)
class Veil:
    """A flare of an outside package that spends the error allowed on its own rays."""

    error_allowed: float | None = None

    accuracy_knobs = (
        AccuracyKnob(
            "error_allowed", (0.1, 0.01), Quantity.IRRADIANCE, Cost(0.02, 1.5), budgeted=True
        ),
    )

    def irradiance(self, lens, mixed):
        raise NotImplementedError


def test_the_budget_is_divided_over_whatever_the_components_declare():
    parts = Chain(
        None, None, None, {}, build("lens", "diffraction_limited"), {"v": Veil()}, {}, None, {}
    )
    shares = budget.division(found := spending.of_chain(parts))
    assert [one.who for one in found] == ["lens"] * 3 + ["flare v"]
    [(who, veil)] = shares.by_field.items()
    assert who == ("flare v", "error_allowed")
    assert shares.store + shares.light + veil == pytest.approx(1.0, rel=1e-12)
    # condition of Lagrange for the minimum: a small increase of the error saves the flare as many
    # seconds as the store
    rate = STORE_COST.seconds / (USUAL * shares.store)
    cost = found[-1].share.cost
    error = USUAL * veil
    assert cost.seconds * cost.power * error ** -(cost.power + 1) == pytest.approx(rate, rel=1e-9)


def test_without_declarations_and_with_bundled_lenses_the_store_has_its_usual_share():
    of = {}
    for name in ("ideal", "diffraction_limited", "wavefront", "prescription"):
        lens = build("lens", name)
        of[name] = budget.division(
            spending.of_chain(Chain(None, None, None, {}, lens, {}, {}, None, {}))
        )
    for shares in of.values():
        # the root is found to 2e-12
        assert shares.store == pytest.approx(STORE, rel=1e-11) and not shares.by_field
        assert shares.light == pytest.approx(1 - STORE, rel=1e-11)
    lone = budget.division([budget.Spending("flare", "f", ErrorShare("e", Cost(1.0)), "e")])
    # the lens declares nothing and the flare does: their shares have the ratio of the costs
    light = STORE_COST.seconds * (1 - STORE) / STORE
    assert lone.by_field["f", "e"] / lone.light == pytest.approx(1.0 / light, rel=1e-9)


def test_a_component_is_told_its_share_in_its_field_unless_a_user_has_set_it():
    lens = build("lens", "diffraction_limited")
    sensor = build("sensor", "bayer")
    flares = {"told": Veil(), "set": Veil(0.25)}
    parts = Chain(None, None, None, {}, lens, flares, {"c": sensor}, None, {})
    done = spending.with_shares(parts, lambda: 1e-3)
    share = done.shares.by_field["flare told", "error_allowed"]
    assert done.flares == {"told": Veil(share * 1e-3), "set": Veil(0.25)} and share > 0
    assert ("flare set", "error_allowed") not in done.shares.by_field
    assert done.lens is lens and done.cameras == {"c": sensor}
    exact = spending.with_shares(parts, lambda: 0.0)
    assert exact.flares == flares  # light must be exact: no component gets an error


def test_all_reserved_is_refused():
    every = [budget.Spending("lens", "lens", ErrorShare("a", reserved=0.5)) for _ in range(2)]
    with pytest.raises(ConfigError, match="reserve all of the error allowed"):
        budget.division(every)


def test_a_renderer_is_told_in_the_field_that_it_declares():
    @dataclass(frozen=True)
    class Acme:
        target: float | None = None
        accuracy_knobs = (
            AccuracyKnob("target", (0.1, 0.01), Quantity.RADIANCE, Cost(1.0, 2.0), budgeted=True),
        )

    given = budget.Allowed(render_error=0.2)
    assert budget.renderer_with_error(Acme(), given) == Acme(0.2)
    with pytest.raises(ConfigError, match="renderer.target is 0.3.*set one of them"):
        budget.renderer_with_error(Acme(0.3), given)


def test_a_flare_of_an_outside_package_is_told_its_share_by_the_composed_chain(monkeypatch):
    outside = Component("flare", "acme", Veil)
    monkeypatch.setitem(registry.components(), ("flare", "acme"), outside)
    told = [*SMALL, "+flare@flare.v=acme", "lens=diffraction_limited"]
    parts = chain(compose(told))
    rows = ledger.Ledger()
    demand = plan(parts, rows)
    share = parts.shares.by_field["flare v", "error_allowed"]
    allowed = [
        e.value for e in rows[0].errors if e.label.startswith("error allowed after the radiance")
    ]
    assert parts.flares["v"].error_allowed == pytest.approx(share * allowed[0], rel=1e-12)
    assert demand.response.noise_fraction_allowed == pytest.approx(
        0.1 * parts.shares.light, rel=1e-12
    )
    assert budget.stored_error(demand) == pytest.approx(parts.shares.store * allowed[0], rel=1e-12)
    mine = chain(compose([*told, "flare.v.error_allowed=0.01"]))
    assert mine.flares["v"] == Veil(0.01) and not mine.shares.by_field
    exact = chain(compose([*told, "sensor.noise=false"]))
    assert exact.flares["v"] == Veil()  # without noise, no error is allowed
