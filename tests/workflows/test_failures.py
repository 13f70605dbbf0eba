"""Failures of commands: Ctrl-C, a plugin that raises, bad input. No half-written store is left, and
one line says why.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess

import pytest

from isethdr_core import compose, run
from isethdr_core.errors import ConfigError, IsetHdrError

from .command import (
    FAST,
    LIGHTS,
    here,
    installed_trouble,
    isethdr,
    leftovers,
    one_by_one,
    start,
    stores,
    wait_for,
)

ONE = ["run", *LIGHTS, "lighting=ideal", "sensor=ideal"]


# quick tests of a writer that is interrupted or killed are in tests/core/storage/test_store.py
@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "number", "code"),
    [("metric", signal.SIGINT, 130), ("store", signal.SIGTERM, 143)],
)
def test_an_interrupted_run_leaves_nothing_half_written(tmp_path, where, number, code):
    home = tmp_path / "home"
    home.mkdir()
    process = start(
        *ONE,
        "+metric@metric.acme=acme",
        plugins=[installed_trouble(tmp_path / "plugins")],
        ISETHDR_HOME=str(home),
        ACME_WAIT=where,
        ACME_MARK=str(home / "mark"),
    )
    wait_for(home / "mark", process)
    assert (where == "store") == bool(leftovers(home)), "what is being written has a temporary name"
    os.killpg(process.pid, number)
    _, said = process.communicate(timeout=600)
    assert process.returncode == code
    assert stores(home) == {} and leftovers(home) == []
    assert not (home / "failed").exists(), "to be interrupted is no failure"
    assert re.fullmatch(r"interrupted: .*\n", said) if number == signal.SIGINT else said == ""


@pytest.mark.slow
def test_a_plugin_that_raises(isethdr_home, tmp_path):
    plugins = [installed_trouble(tmp_path / "plugins")]
    errors = tmp_path / "errors"
    one = [*ONE, "+metric@metric.acme=acme"]
    sweep = ["run", "-m", *ONE[1:], "+metric@metric.acme=acme,ideal"]
    (code, said), (beside, said_beside) = one_by_one(
        one, sweep, plugins=plugins, ACME_RAISE="1", ACME_ERRORS=str(errors)
    )
    [failed] = (isethdr_home / "failed").glob("*.txt")
    assert code == 1
    assert (
        said == "error: RuntimeError: glass broke in two; in stage metric acme ideal; traceback in"
        f" {failed}\n"
    )
    assert errors.read_text().splitlines() == 2 * [
        "metric acme ideal RuntimeError",
        f"run {failed.stem} RuntimeError",
    ]
    assert "Traceback" in failed.read_text() and "acme_trouble.py" in failed.read_text()

    # other jobs of a sweep are not affected; the file in `failed` goes once the run succeeds
    assert beside == 1 and len(stores(isethdr_home)) == 1 and leftovers(isethdr_home) == []
    assert (
        "error: job " in said_beside
        and "glass broke" in said_beside
        and "Traceback" not in said_beside
    )
    healed = isethdr(*one, plugins=plugins)
    assert (
        healed.returncode == 0
        and f"{failed.stem}.zarr" in stores(isethdr_home)
        and not failed.exists()
    )


MISTAKES = [
    ([*LIGHTS, "sensor=idael"], "did you mean 'ideal'"),
    ([*LIGHTS, "sensor=ideal", "sensor.pitch_mu=3"], "did you mean 'pitch_um'"),
    ([*LIGHTS, "sensor=ideal", "lihgting=night"], "did you mean 'lighting'"),
    ([*LIGHTS, "sensor=ideal", "sensor.pitch_um=-1"], "pitch_um is -1"),
    ([*LIGHTS, "sensor.exposure_s=1"], "type sensor=<name>"),
    (
        [*LIGHTS, "sensor=ideal", "lighting=weights", "lighting.weights.sky=1"],
        r"type \+lighting.weights.sky=1",
    ),
    (
        [*LIGHTS, "sensor=ideal", "lighting=weights", "+lighting.weights.sky=-1"],
        "with -1.0 in it; expected 0 to .*weights={sky:0}",
    ),
    (
        [*LIGHTS, "sensor=ideal", "lighting=weights", "+lighting.weights.skyy=1"],
        "did you mean 'sky'",
    ),
    (
        [*LIGHTS, "sensor=ideal", "sensor.columns=9999", "lighting=ideal"],
        r"type sensor.columns=\d+",
    ),
    (
        ["scene=uniform", *FAST, "scene.width=0", "sensor=ideal"],
        "expected 1 to .* type .*scene.width=320",
    ),
    (
        [*LIGHTS, "sensor=ideal", "sensor.pitch_um=${nope}"],
        r"sensor.pitch_um cannot be resolved.*type for example",
    ),
    ([*LIGHTS, "sensor=ideal", "sensor.pitch_um=${oc.env:NO_SUCH_VARIABLE}"], "NO_SUCH_VARIABLE"),
    (
        [*LIGHTS, "sensor=ideal", "sensor.pitch_um=${no_resolver:1}"],
        "no_resolver.*type for example",
    ),
    ([*LIGHTS, "sensor=ideal", "seed=${seed}"], "seed"),
    ([*LIGHTS, "sensor=ideal", "hydra.run.dir=${nope}"], "nope"),
    ([*LIGHTS, "sensor=ideal", "isp=${oc.create:{}}"], "expected key=value"),
    ([*LIGHTS, "sensor=ideal", "isp='${oc.create:{}}'"], "isp"),
    ([*LIGHTS, "sensor=ideal", 'isp="${oc.create:{}}"'], "isp"),
    ([*LIGHTS, "sensor=ideal", "scene=[1]"], "expected <kind>=<name>"),
    ([*LIGHTS, "sensor=ideal", "a b"], "'a b' cannot be read; expected key=value"),
    ([*LIGHTS, "sensor=ideal", "${x}=3"], "cannot be read; expected key=value"),
    ([*LIGHTS, "sensor=ideal", "+lighting=${seed}"], "lighting"),
    ([*LIGHTS, "~cameras", "+cameras=3"], "cameras is 3; expected entries by name"),
    (
        [
            "scene=iset_exr",
            "scene.folder=.",
            "scene.scene_id='1112184733'",
            *FAST[3:],
            "sensor=ideal",
            "lighting=ideal",
        ],
        "EXR file, or is cut off",
    ),
]


# one mistake of each kind: a name, a value that the run refuses, settings of Hydra, the syntax of
# overrides, a value in place of a table, a file
BY_COMMAND = [m for m in MISTAKES if set(m[0]) & {"sensor=idael", "sensor.columns=9999"}]
BY_COMMAND += [m for m in MISTAKES if set(m[0]) & {"hydra.run.dir=${nope}", "a b"}]
BY_COMMAND += [m for m in MISTAKES if set(m[0]) & {"+cameras=3", "scene=iset_exr"}]


@pytest.fixture
def cut_off_file(tmp_path, monkeypatch):
    """Work in a folder with an EXR file that ends after a few bytes."""
    (tmp_path / "1112184733_skymap.exr").write_bytes(b"\x76\x2f\x31\x01\x02cut off")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("overrides, message", BY_COMMAND, ids=[m for _, m in BY_COMMAND])
def test_bad_input_is_one_line_and_stores_nothing(
    overrides, message, isethdr_home, cut_off_file, monkeypatch, capsys
):
    code, said = here(monkeypatch, capsys, "run", *overrides)
    [line] = said.splitlines()
    assert code == 2 and line.startswith("error: ") and re.search(message, line), line
    assert stores(isethdr_home) == {} and leftovers(isethdr_home) == []


IN_PYTHON = [m for m in MISTAKES if not any(o.startswith("hydra.") for o in m[0])]


@pytest.mark.parametrize("overrides, message", IN_PYTHON, ids=[m for _, m in IN_PYTHON])
def test_bad_input_in_python_is_the_same_line(overrides, message, isethdr_home, cut_off_file):
    with pytest.raises(IsetHdrError, match=message) as refused:
        run(compose(overrides))
    assert len(str(refused.value).splitlines()) == 1
    assert stores(isethdr_home) == {} and leftovers(isethdr_home) == []


def test_a_home_that_cannot_be_written_is_found_before_any_work(tmp_path, monkeypatch, capsys):
    home = tmp_path / "home"
    home.write_text("a file where the folder should be")
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    code, said = here(monkeypatch, capsys, *ONE)
    [line] = said.splitlines()
    assert (
        code == 2 and line.startswith("error: cannot write stores into") and "ISETHDR_HOME=" in line
    )
    assert home.read_text() == "a file where the folder should be"


def test_a_sweep_into_a_home_that_cannot_be_written_is_one_line(tmp_path, monkeypatch, capsys):
    home = tmp_path / "home"
    home.write_text("a file where the folder should be")
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    code, said = here(monkeypatch, capsys, "run", "-m", *ONE[1:], "seed=1,2")
    [line] = said.splitlines()
    assert code == 2 and line.startswith("error: cannot write stores into")


@pytest.mark.parametrize("given", [["sensor=rgbw"], "sensor=rgbw", None, 3])
def test_run_says_that_overrides_have_to_be_composed(given):
    with pytest.raises(ConfigError, match=r"type for example hdr.run\(hdr.compose\("):
        run(given)


def test_a_damaged_store_is_named_and_kept(isethdr_home, monkeypatch, capsys):
    run(compose(ONE[1:]))
    [path] = (isethdr_home / "runs").glob("*.zarr")
    (path / "zarr.json").write_text("{")
    code, said = here(monkeypatch, capsys, *ONE)
    [line] = said.splitlines()
    assert (
        code == 2 and str(path) in line and "damaged" in line and "isethdr catalog verify" in line
    )
    assert (path / "zarr.json").read_text() == "{", "what cannot be read may still be saved by hand"


@pytest.fixture
def tiny_disk(tmp_path):
    """Mount a disk of 64 kB, or skip."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    if (
        mount is None
        or subprocess.run(
            [mount, "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder],
            capture_output=True,
            check=False,
        ).returncode
    ):
        pytest.skip(
            "no tmpfs can be mounted here; tests/core/storage/test_store.py simulates a full disk"
        )
    yield folder
    subprocess.run(["umount", folder], check=True)


def test_a_full_disk_is_one_line(tiny_disk, monkeypatch, capsys):
    monkeypatch.setenv("ISETHDR_HOME", str(tiny_disk))
    code, said = here(monkeypatch, capsys, *ONE)
    [line] = said.splitlines()
    assert code == 2 and "the disk is full" in line
    assert stores(tiny_disk) == {} and leftovers(tiny_disk) == []
