"""The missing part of a demand: the groups and bands that are not stored, and no others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from isethdr_core import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import IsetHdrError
from isethdr_core.ledger import Ledger
from isethdr_core.plugins.registry import build
from isethdr_core.runs.radiance_cache import held_and_missing, recipe_hash, what_is_missing
from isethdr_core.runs.radiance_cache.joined_radiance import LABELS_NOT_MADE, opened
from isethdr_core.runs.radiance_cache.missing_radiance import render_and_store
from isethdr_core.runs.radiance_cache.recipe import scenes_folder
from isethdr_core.runs.radiance_cache.render_request import Request
from isethdr_core.runs.radiance_cache.stored_radiance import held, serves
from isethdr_core.uncertainty import ledger

BLUE = 450.0
GREEN = 550.0
RED = 650.0


def stored(groups, bands, asked=(), absent=()):
    """Return attributes of a store; `asked` is None if it was rendered at all bands of the
    renderer.
    """
    return {
        "groups": groups,
        "absent_groups": absent,
        "all_groups": ["sky", "lamps"],
        "wavelength_nm": bands,
        "bands_asked": asked,
    }


def test_nothing_stored_lacks_everything():
    for demand in (Demand(), Demand(groups=("sky",)), Demand(wavelength_nm=(RED,))):
        assert what_is_missing([], demand) == demand


def test_groups_and_bands_are_lacking_one_by_one():
    found = [stored(["sky"], [BLUE, GREEN]), stored(["lamps"], [BLUE])]
    both = Demand(groups=("sky", "lamps"))
    assert what_is_missing(found, Demand(groups=("sky",), wavelength_nm=(BLUE, GREEN))) is None
    lacking = what_is_missing(found, Demand(groups=both.groups, wavelength_nm=(BLUE, GREEN)))
    assert (lacking.groups, lacking.wavelength_nm) == (("lamps",), (GREEN,))
    lacking = what_is_missing(found, Demand(groups=both.groups, wavelength_nm=(BLUE, GREEN, RED)))
    assert (lacking.groups, lacking.wavelength_nm) == (("sky", "lamps"), (GREEN, RED))


@pytest.mark.parametrize("asked", [None, (BLUE,)])
def test_a_demand_for_all_bands_takes_no_store_of_a_few(asked):
    lacking = what_is_missing([stored(["sky", "lamps"], [BLUE], asked)], Demand())
    assert (
        lacking is None
        if asked is None
        else (lacking.groups, lacking.wavelength_nm) == (("sky", "lamps"), None)
    )


def test_a_group_without_a_lamp_is_not_lacking():
    assert what_is_missing([stored(["sky"], [BLUE], None, absent=("lamps",))], Demand()) is None


def test_radiance_without_overscan_serves_beside_a_part_with_overscan():
    chain = SimpleNamespace(renderer=object())
    beside = {"labels": [], "effort": {}}
    narrow = {**stored(["sky", "lamps"], [BLUE], None), **beside, "margin": False}
    wide = {**stored(["sky"], [BLUE], None), **beside, "margin": True}
    demand = Demand(groups=("sky", "lamps"), wavelength_nm=(BLUE,), margin=False)
    assert held(chain, demand, [narrow, wide]) == ([narrow], None)
    of_sky = replace(demand, groups=("sky",))
    assert held(chain, of_sky, [narrow, wide]) == ([wide], None)
    lacking = held(chain, replace(demand, margin=True), [narrow, wide])
    assert lacking.stores == [wide] and lacking.missing.groups == ("lamps",)


def test_radiance_rendered_for_cameras_serves_who_allows_as_much_of_their_noise():
    demand = Demand(groups=("sky",), wavelength_nm=(BLUE,))
    by_need = {**stored(["sky"], [BLUE], None), "limit_share": 0.6}
    by_paths = stored(["sky"], [BLUE], None)
    enough = lambda paths, noise: True
    assert what_is_missing([by_need], demand, enough, 0.6) is None
    assert what_is_missing([by_need], demand, enough, 0.5) is not None
    assert what_is_missing([by_paths], demand, enough, 0.6) is not None
    assert what_is_missing([by_paths], demand, enough) is None


def test_radiance_whose_paths_were_limited_serves_who_limits_them_alike():
    """The radiance has more noise than allowed, but rendering it again would not reduce it."""
    demand = Demand(groups=("sky",), wavelength_nm=(BLUE,))
    limited = {**stored(["sky"], [BLUE], None), "limit_share": 0.9, "effort": {"most": 64}}
    enough = lambda paths, noise: True
    assert what_is_missing([limited], demand, enough, 0.6, {"most": 64}) is None
    assert what_is_missing([limited], demand, enough, 0.6, {"most": 128}) is not None
    assert what_is_missing([limited], demand, enough, 0.6) is not None


@dataclass(frozen=True)
class TableRenderer:
    """A renderer that reads a file."""

    table: str

    def __call__(self, description, demand):
        """Not called here."""
        raise AssertionError("the name of radiance follows without rendering")

    def input_files(self):
        """Return the file that the renderer reads."""
        return (self.table,)


def test_a_changed_file_of_the_renderer_renames_its_radiance(tmp_path, isethdr_home):
    table = tmp_path / "table.csv"
    renderer = TableRenderer(str(table))
    chain = SimpleNamespace(scene=build("scene", "macbeth"), renderer=renderer, exposures=None)
    names = []
    for content in ("1", "2", "1"):
        table.write_text(content)
        names.append(recipe_hash(chain))
    assert names[0] == names[2] != names[1]


def test_a_label_that_the_renderer_does_not_make_serves_once_it_was_asked_for():
    labelled = {"labels": ["depth"], "labels_asked": ["depth", "instance"], "effort": {}}
    earlier = {"labels": ["depth"], "effort": {}}
    both = Demand(labels=frozenset({"depth", "instance"}))
    assert serves(labelled, both, {})
    assert not serves(labelled, both.with_labels("normal"), {})
    assert not serves(earlier, both, {}) and serves(earlier, Demand().with_labels("depth"), {})


@dataclass(frozen=True)
class Unlabelled:
    """A renderer of a uniform sky that makes no labels."""

    width: int = 4

    def __call__(self, description, demand):
        """Return one light group at two bands."""
        x = quantities.centres(self.width, 0.4)
        y = quantities.centres(3, 0.3)
        cube = np.ones((1, 2, 3, self.width), np.float32)
        return quantities.scene_radiance(cube, ("sky",), (450.0, 550.0), x, y, (0.4, 0.3))


def test_a_label_that_is_not_made_renders_once_and_is_stated_in_every_run(isethdr_home, offer):
    offer("renderer", "unlabelled", Unlabelled)
    renderer = Unlabelled()
    chain = SimpleNamespace(scene=build("scene", "macbeth"), renderer=renderer, exposures=None)
    description = SimpleNamespace(name="sky", light_groups=lambda: ("sky",))
    demand = Demand(labels=frozenset({"instance"}))
    config = SimpleNamespace(renderer=SimpleNamespace(name="unlabelled"))
    request = Request(description, demand, renderer, None)
    made = render_and_store(chain, request, recipe_hash(chain), Ledger(), config)
    serving, missing = held_and_missing(chain, demand)
    assert missing is None and [s["id"] for s in serving] == [made["id"]]
    for asked, wanted in ((demand, ["labels instance"]), (Demand(), [])):
        rows = Ledger()
        with ledger.stage(rows, "radiance"):
            opened(scenes_folder(), serving, asked, rows)
        left = [o.what for o in rows[0].left_out if o.key == LABELS_NOT_MADE]
        assert left == wanted


def sky_with(**attributes):
    """Return a function that gives radiance of a sky other attributes."""
    return lambda radiance: radiance.assign_attrs(attributes)


RENDERER_FAULTS = {
    "nothing": (lambda radiance: None, "returned NoneType; expected an xarray.Dataset"),
    "an array": (lambda radiance: radiance.radiance, "returned DataArray; expected"),
    "no groups": (lambda radiance: radiance.isel(light_group=[]), "is empty"),
    "negative light": (lambda radiance: -radiance.assign_attrs(radiance.attrs), "units|negative"),
    "other dims": (lambda radiance: radiance.transpose("y", ...), "expected .*light_group"),
    "no field": (sky_with(field_width=None), "'field_width' is None; expected the camera's full"),
    "half of the field": (
        lambda radiance: radiance.isel(x=slice(0, 2)),
        "the tiles cover 0.2 along x, but field_width is 0.4",
    ),
    "an object without a box": (
        sky_with(objects=[{"instance": 1, "category": "car", "name": "car"}]),
        "entry 0 of the attribute 'objects' lacks 'box'",
    ),
    "an object that is a name": (sky_with(objects=["car"]), "is 'car'; expected a dictionary"),
    "a box of two numbers": (
        sky_with(objects=[{"instance": 1, "category": "car", "name": "car", "box": [1, 2]}]),
        r"box \[1, 2\]; expected",
    ),
    "a ragged box": (
        sky_with(objects=[{"instance": 1, "category": "car", "name": "c", "box": [1, [2], 3, 4]}]),
        r"box \[1, \[2\], 3, 4\]; expected",
    ),
    "a box of texts": (
        sky_with(objects=[{"instance": 1, "category": "car", "name": "c", "box": list("abcd")}]),
        r"box \['a', 'b', 'c', 'd'\]; expected",
    ),
    "an array of objects": (
        sky_with(objects=np.array([{}, {}])),
        r"'objects' is of type ndarray; expected a list of dictionaries",
    ),
    "a number of objects": (sky_with(objects=5), "'objects' is of type int; expected a list"),
}


@dataclass(frozen=True)
class Faulty(Unlabelled):
    """A renderer with one fault."""

    fault: str = ""

    def __call__(self, description, demand):
        """Return radiance with the fault."""
        return RENDERER_FAULTS[self.fault][0](super().__call__(description, demand))


@pytest.mark.parametrize("fault", RENDERER_FAULTS)
def test_wrong_radiance_of_a_renderer_is_refused_by_name_and_not_stored(fault, isethdr_home):
    renderer = Faulty(fault=fault)
    chain = SimpleNamespace(scene=build("scene", "macbeth"), renderer=renderer, exposures=None)
    description = SimpleNamespace(name="sky", light_groups=lambda: ("sky",))
    config = SimpleNamespace(renderer=SimpleNamespace(name="faulty"))
    request = Request(description, Demand(), renderer, None)
    with pytest.raises(IsetHdrError, match=f"renderer 'faulty'.*({RENDERER_FAULTS[fault][1]})"):
        render_and_store(chain, request, "abc", Ledger(), config)
    assert not list(scenes_folder().glob("*"))
