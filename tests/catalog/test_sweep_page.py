"""The page of a sweep is one file that loads nothing; the catalog finds its runs by labels."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace

from isethdr_catalog import space
from isethdr_catalog.query import find
from isethdr_catalog.report import write_sweep_page
from isethdr_catalog.report.sweep_page import _command, sweep_page

from isethdr_core.runs.labels import Labels, add_labels, path_of
from isethdr_core.sweeps.table import sweep_table

from ..core.sweeps.stored_sweep import stored_sweep


def test_the_page_holds_every_row_and_links_to_reports(isethdr_home):
    sweep = stored_sweep(isethdr_home, failed=True)
    path = write_sweep_page(sweep_table(sweep))
    text = path.read_text()
    data = json.loads(re.search(r'id="sweep-data">(.*?)</script>', text, re.DOTALL).group(1))
    assert [row["parameters"]["sensor"] for row in data["rows"]] == ["bayer", "bayer", "rgbw"]
    assert data["rows"][1]["scores"] == {"ssim": [0.6, 0.58, 0.62], "vividness": [1.0, None, None]}
    assert all((sweep.folder / row["report"]).exists() for row in data["rows"])
    assert "glass broke" in text and "default-src 'none'" in text
    assert not re.findall(r'(?:src|href)="(?:https?:)?//', text), "nothing is loaded"


def test_names_of_others_add_no_markup(isethdr_home):
    sweep = stored_sweep(isethdr_home)
    table = sweep_table(sweep)
    strange = "</script><script>alert(1)</script>"
    table.units[strange] = strange
    for row in table.rows:
        row.scores[strange] = row.scores["vividness"]
        row.parameters["sensor"] = strange
    assert "<script>alert" not in sweep_page(table)


def test_the_command_of_a_sweep_runs_in_a_shell(isethdr_home):
    table = sweep_table(stored_sweep(isethdr_home))
    typed = ("sensor.exposure_s=range(0.001,0.01,0.003)", "lighting.weights={sky: 1}", "name_=it's")
    table = replace(table, sweep=replace(table.sweep, overrides=typed))
    words = shlex.split(_command(table).replace("\\\n", " "))
    assert words == ["isethdr", "run", "-m", "name=exposures", "tags=wet", *typed]
    assert "\n    'sensor.exposure_s=range(0.001,0.01,0.003)' \\\n" in _command(table)


def test_runs_are_found_by_sweep_tag_and_name(isethdr_home):
    stored_sweep(isethdr_home)
    assert {row["id"] for row in find(isethdr_home, sweeps="exposures")} == {
        "exposures0",
        "exposures1",
        "exposures2",
    }
    store = isethdr_home / "runs" / "exposures1.zarr"
    add_labels(store, Labels("mine", ("later",)))
    [row] = find(isethdr_home, tags="later")
    assert row["id"] == "exposures1", "a label that was added after the index was made"
    assert [r["id"] for r in find(isethdr_home, name="mine")] == ["exposures1"]
    space.remove_store(isethdr_home, store, False)
    assert not path_of(store).exists()
    assert find(isethdr_home, tags="later", kind="run") == []
