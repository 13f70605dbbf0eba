"""The missing part of a demand: the groups and bands that are not stored, and no others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from isethdr_core.demand import Demand
from isethdr_core.plugins.registry import build
from isethdr_core.runs.radiance_cache import recipe_hash, what_is_missing
from isethdr_core.runs.radiance_cache.stored_radiance import held

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
