"""The scene `stored`: light, labels and errors of a store, selected by its name."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.stored import Stored

from isethdr_core.conformance.renderer import world
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs.provenance import input_digests
from isethdr_core.store import write_store
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity, Source
from isethdr_core.uncertainty.ledger import Ledger

BANDS = np.linspace(400, 700, 7)
NOISE = ErrorTerm(
    Source("renderer/any"), Quantity.RADIANCE, None, 0.02, "relative", "statistical", "its noise"
)


@pytest.fixture
def kept(isethdr_home):
    """Store light of two groups over four decades, as a renderer does, and return the light."""
    groups = world().light_groups()[:2]
    level = 10 ** np.random.default_rng(2).uniform(-6, -2, (2, 7, 8, 12))
    instance = np.arange(96, dtype=np.uint32).reshape(8, 12)
    light = scene_radiance(
        level, groups, BANDS, centres(12, 0.6), centres(8, 0.4), instance=instance
    )
    rows = Ledger()
    with ledger.stage(rows, "renderer any"):
        ledger.record(NOISE)
    attributes = {
        "kind": "scene",
        "recipe": "abc0",
        "groups": [*groups],
        "ledger": rows.as_records(),
    }
    write_store(isethdr_home / "scenes", "abc0-1", {"": light}, attributes, None)
    return light


def test_light_and_labels_come_back_bit_for_bit(kept):
    for name in ("abc0-1", "abc0", "ab"):
        scene = Stored(name)()
        for variable in ("radiance", "instance"):
            np.testing.assert_array_equal(scene[variable], kept[variable])
    assert Stored("abc0").light_groups() == tuple(kept.light_group.values)
    assert Stored("abc0").bands_nm() == tuple(BANDS)


def test_the_kit_takes_it(kept):
    check("scene", "stored", store="abc0")


def test_errors_that_the_renderer_stated_are_stated_again(kept):
    rows = Ledger()
    with ledger.stage(rows, "scene stored"):
        Stored("abc0")()
    assert [term.value for term in rows[0].errors] == [NOISE.value]


def test_another_store_gives_a_run_another_name(kept, isethdr_home):
    before = input_digests(Stored("abc0"))
    attributes = {"kind": "scene", "recipe": "abd0", "groups": [*kept.light_group.values]}
    write_store(isethdr_home / "scenes", "abd0-1", {"": 2 * kept}, attributes)
    assert input_digests(Stored("abc0")) == before
    assert set(input_digests(Stored("abd0")).values()) != set(before.values())
    with pytest.raises(CatalogError, match="could be any of abc0-1, abd0-1"):
        Stored("ab").check_files()


def test_a_store_that_is_not_there_is_named(kept):
    with pytest.raises(CatalogError, match="'xyz'.*catalog find kind=scene"):
        Stored("xyz").check_files()
    with pytest.raises(ConfigError, match="type for example scene.store="):
        Stored().check_files()
