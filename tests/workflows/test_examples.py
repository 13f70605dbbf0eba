"""Each example of docs/examples is a pair: a YAML file and Python by hand give the same bits."""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.plugins.component import KINDS

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
CONFIGS = EXAMPLES / "conf" / "experiment"
PAIRS = sorted(path.stem for path in CONFIGS.glob("*.yaml"))
QUICK_PAIRS = ("05_own_metric",)
# metrics to leave out: they change no capture and take most of the time of a small run
WITHOUT = ("snr", "colour", "ssim", "log_luminance", "contrast", "detection", "dynamic_range")
QUICK = ["draws=1", "report=false", *(f"~metric.{name}" for name in WITHOUT)]


def test_every_example_is_a_pair_and_on_the_page():
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == PAIRS
    assert [name[:3] for name in PAIRS] == [f"{k:02}_" for k in range(1, len(PAIRS) + 1)]
    page = (EXAMPLES / "README.md").read_text()
    for name in PAIRS:
        assert f"]({name}.py)" in page and f"](conf/experiment/{name}.yaml)" in page
        assert f"isethdr run experiment={name}\n" in page


@pytest.mark.parametrize(
    "name",
    [pytest.param(k, marks=() if k in QUICK_PAIRS else pytest.mark.slow) for k in PAIRS],
)
def test_both_files_of_a_pair_give_the_same_bits(name, offer, tmp_path, monkeypatch):
    shutil.copytree(CONFIGS.parent, tmp_path / "conf")
    monkeypatch.chdir(tmp_path)
    by_hand = runpy.run_path(str(EXAMPLES / f"{name}.py"))
    if "DarkerThan" in by_hand:
        offer("metric", "darker_than", by_hand["DarkerThan"])
    result = hdr.run(hdr.compose([f"experiment={name}", *QUICK]))
    [camera] = result.cameras
    stored = result.open(f"captures/{camera}")
    captures = by_hand["captures"]
    for variable in ("raw", "saturated", "filter"):
        assert np.array_equal(stored[variable].values, captures[variable].values), variable
    assert len(np.unique(captures["raw"].values)) > 50
    if "score" in by_hand:
        [score] = [s for s in result.scores if s["metric"] == by_hand["score"].metric]
        assert score["value"] == by_hand["score"].value and 0 < score["value"] < 1


def test_the_examples_use_each_kind_but_the_renderer():
    text = "".join(path.read_text() for path in EXAMPLES.glob("*.py"))
    built = set(re.findall(r'build\(\s*"(\w+)"', text)) | {"metric"}
    assert built == set(KINDS) - {"renderer"}
