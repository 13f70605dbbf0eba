"""Plugins written for earlier versions go on working: frozen copies give the same numbers."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from ..command_line import isethdr

FROZEN = Path(__file__).parents[2] / "frozen_plugins"
PLUGINS = ("acme_camera", "acme_scores_with_fields", "acme_spread_errors", "acme_statements")
CHECKSUMS = {
    "acme_camera/__init__.py": "c9d8233611ad3bae",
    "acme_camera/conf/__init__.py": "e3b0c44298fc1c14",
    "acme_camera/conf/experiment/acme_night.yaml": "1e07c5d9d57ccdc4",
    "acme_camera/conf/sensor/acme_nano_night.yaml": "cb170e16f2646983",
    "acme_camera/lens.py": "7b8ca0afd48328bf",
    "acme_camera/sensor.py": "5bbd6ca4e54a6967",
    "acme_scores.py": "243743c21bc9faf5",
    "acme_scores_with_fields.py": "8646912d05ba5c84",
    "acme_spread_errors.py": "d0ed725f582b0ea8",
    "acme_statements.py": "c88620ab27da2d98",
}
RUNS = """
import json
import isethdr_core as hdr
from isethdr_core.testing import check

check("metric", "darkest")
check("lens", "acme_plastic")
check("sensor", "acme_nano")
night = ["experiment=acme_night", "isp=merge", "report=false"]
more = ["draws=2", "+metric@metric.darkest=darkest", "metric.darkest.share=0.01"]
scores = {s["metric"]: s["value"] for s in hdr.run(hdr.compose(night + more)).scores}
ledger = hdr.run(hdr.compose([*night, "lens=acme_stating", "seed=8"])).ledger
found = {
    stage: [error.value for row in ledger if row.stage.startswith(stage) for error in row.errors]
    for stage in ("lens", "picture")
}
print(json.dumps({"scores": scores} | found))
"""
CALLS = """
import json
import warnings
import numpy as np
import isethdr_core as hdr
from isethdr_core.pipeline.imaging_plan import TrivialPlan

mixed = hdr.build("lighting", "ideal")(hdr.build("scene", "uniform", width=8, height=6)())
light = hdr.build("lens", "acme_stating")(mixed)
counting = hdr.build("sensor", "acme_counting")
key = hdr.generator(seed=7, device="A", scene="s")
raw = float(counting(light, key).raw.sum())
mean = float(counting.expected(light).sum())
errors = {}
for name in ("acme_measuring", "acme_doubting"):
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        lens = hdr.build("lens", name)
        maps = TrivialPlan(lens).light_errors(mixed, np.ones((1, mixed.sizes["wavelength"])))
    share = [float((values / lens(mixed).values.sum(0)).mean()) for values in maps[:2]]
    values = [float(values.mean()) for values in maps[:2]]
    old = [str(w.message) for w in warned if w.category is DeprecationWarning]
    errors[name] = {"share": share, "values": values, "warned": old}
print(json.dumps({"raw": raw, "mean": mean, "errors": errors}))
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Copy the frozen plugins into a folder of installed packages."""
    folder = tmp_path_factory.mktemp("site")
    for path in FROZEN.glob("acme_*"):
        copy = shutil.copytree if path.is_dir() else shutil.copy
        copy(path, folder / path.name)
    for package in PLUGINS:
        info = folder / f"{package}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[isethdr]\n{package} = {package}\n")
    return folder


def test_nobody_has_changed_them():
    found = {
        path.relative_to(FROZEN).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        for path in FROZEN.rglob("*")
        if path.suffix in (".py", ".yaml")
    }
    assert found == CHECKSUMS, "these files are frozen: see tests/frozen_plugins/README.md"


@pytest.mark.slow
def test_they_are_listed_without_a_word(site):
    shown = isethdr("plugins", "--strict", plugins=[site])
    assert shown.returncode == 0 and not shown.stderr
    for name in ("acme_nano", "acme_plastic", "acme_stating", "acme_counting", "darkest"):
        assert name in shown.stdout


@pytest.mark.slow
def test_the_first_ten_lines_of_the_tutorial_are_listed(site):
    info = site / "acme_scores_with_fields-1.0.dist-info" / "entry_points.txt"
    kept = info.read_text()
    info.write_text("[isethdr]\nacme = acme_scores\n")  # it offers a metric of the same name
    try:
        shown = isethdr("plugins", "metric", plugins=[site])
    finally:
        info.write_text(kept)
    assert shown.returncode == 0 and not shown.stderr
    assert "Luminance of the darkest valid pixel." in shown.stdout


def printed(site, code):
    """Run `code` in a new process with the frozen plugins; return its last line, read as JSON."""
    shown = isethdr(plugins=[site], code=code)
    assert shown.returncode == 0, shown.stderr
    return json.loads(shown.stdout.splitlines()[-1])


@pytest.mark.slow
def test_they_keep_every_promise_and_their_runs_have_the_numbers_of_before(site):
    found = printed(site, RUNS)
    # measured when they were frozen; 1e-6: sums in float32 in another order
    before = {
        "darkest": 0.8671194801264108,
        "ssim": 0.5138324756023571,
        "log_luminance_error": 0.023469413625602613,
    }
    assert {name: found["scores"][name] for name in before} == pytest.approx(before, rel=1e-6)
    # 29.42 dB when they were frozen; a uniform field does not show where the range begins
    assert "dynamic_range" not in found["scores"]
    assert {0.01, 0.02, 0.03, 0.1} <= set(found["lens"])
    # 1e-2: a hundredth of the stated error may change
    assert max(found["picture"]) == pytest.approx(0.1283781065556878, rel=1e-2)


def test_their_components_give_the_numbers_of_before(site):
    found = printed(site, CALLS)
    # measured when they were frozen
    # 1e-12: keyed noise is the same to the last bit; the order of a sum may change
    assert found["raw"] == pytest.approx(334098.04090031446, rel=1e-12)
    assert found["mean"] == pytest.approx(334100.22806224664, rel=1e-12)
    assert found["errors"]["acme_measuring"]["share"] == pytest.approx([1e-3, 1e-2], rel=1e-6)
    # the ideal lens has no errors: only what the subclass adds is left
    assert found["errors"]["acme_doubting"]["values"] == [1.0, 1.0]
    for errors in found["errors"].values():
        assert any("is now called light_errors" in line for line in errors["warned"])
