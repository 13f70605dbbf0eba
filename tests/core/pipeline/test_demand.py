"""Demands pass from the scores to the scene: narrowing, and the union of the demands of several
cameras.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

from isethdr_core.demand import Demand
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import Chain, plan, union
from isethdr_core.uncertainty import ledger


@dataclass(frozen=True)
class Lighting:
    groups: tuple[str, ...]

    def narrow(self, demand):
        ledger.left_out("the other groups", "weight 0", 0.0, "cd/m2")
        return demand.with_groups(self.groups)


def chain(**parts):
    nothing = SimpleNamespace()
    known = {
        "scene": nothing,
        "renderer": None,
        "lighting": nothing,
        "versions": {},
        "lens": nothing,
        "flares": {},
        "cameras": {"a": nothing},
        "isp": nothing,
        "metrics": {},
    }
    return Chain(**(known | parts))


def test_a_chain_that_narrows_nothing_asks_for_all():
    assert plan(chain(), Ledger()) == Demand()


def test_two_lightings_ask_for_the_groups_of_both():
    rows = Ledger()
    demand = plan(
        chain(lighting=Lighting(("sky",)), versions={"day": Lighting(("sky", "headlights"))}), rows
    )
    assert demand.groups == ("sky", "headlights")
    assert [o.what for o in rows[0].left_out] == ["the other groups"] * 2 and rows[
        0
    ].stage == "plan"


def test_a_lighting_that_needs_all_groups_wins():
    assert (
        plan(
            chain(lighting=Lighting(("sky",)), versions={"day": SimpleNamespace()}), Ledger()
        ).groups
        is None
    )


def test_labels_of_metrics_add_up():
    def metric(label):
        return SimpleNamespace(narrow=lambda demand: demand.with_labels(label))

    assert plan(
        chain(metrics={"a": metric("instance"), "b": metric("depth")}), Ledger()
    ).labels == {"instance", "depth"}


def test_bands_of_two_cameras_are_joined_in_order():
    a = Demand(wavelength_nm=(500.0, 600.0), error_allowed=0.1)
    b = Demand(wavelength_nm=(450.0, 500.0), error_allowed=0.01)
    assert union([a, b]).wavelength_nm == (450.0, 500.0, 600.0)
    assert union([a, b]).error_allowed == 0.01
    assert union([a, Demand()]).wavelength_nm is None


def test_groups_can_only_be_taken_away():
    demand = Demand(groups=("sky", "other"))
    assert demand.with_groups(("other", "headlights")).groups == ("other",)
    assert Demand().with_groups(("other", "headlights")).groups == ("other", "headlights")
    assert demand.groups == ("sky", "other")
