"""A crash outside the stages of a run leaves its traceback in the home folder."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from isethdr_core.config.hydra_app import complaint, keep_traceback, output_closed
from isethdr_core.errors import ConfigError

SMALL = (
    "scene=point_lights",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=4",
    "~renderer",
    "~versions",
    "~flare.dirt",
    "lens=ideal",
    "lighting=ideal",
    "sensor=bayer",
    "isp=linear",
    "draws=1",
    "report=false",
)


def raised(error):
    """Return an exception with a traceback."""
    with pytest.raises(type(error)) as caught:
        raise error
    return caught.value


def test_a_crash_outside_the_stages_names_its_traceback(isethdr_home):
    err = raised(RecursionError("too deep"))
    keep_traceback(err)
    [kept] = (isethdr_home / "failed").glob("*.txt")
    assert "in raised" in kept.read_text() and "RecursionError: too deep" in kept.read_text()
    assert complaint(err) == (f"RecursionError: too deep; traceback in {kept}", 1)
    keep_traceback(err)
    assert len(list((isethdr_home / "failed").glob("*.txt"))) == 1, "a stage has kept its own"


def test_a_mistake_of_the_user_has_no_traceback(isethdr_home):
    keep_traceback(raised(ConfigError("pitch_um is -1")))
    assert not (isethdr_home / "failed").exists()


def test_a_closed_output_is_no_crash_but_a_stage_that_loses_a_pipe_is():
    err = raised(BrokenPipeError(32, "Broken pipe"))
    assert output_closed(err)
    err.add_note("traceback in failed/1f3a.txt")  # as a run adds it
    assert not output_closed(err)
    assert not output_closed(raised(OSError(5, "Input/output error")))


def test_a_run_whose_reader_has_ended_prints_no_message(isethdr_home):
    command = [str(Path(sys.executable).with_name("isethdr")), "run", *SMALL]
    read, write = os.pipe()
    os.close(read)  # as in `isethdr run | head -0`
    with os.fdopen(write, "w") as closed:
        done = subprocess.run(command, stdout=closed, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1
    assert "config" not in done.stderr and "Error" not in done.stderr


def test_a_traceback_may_hold_any_bytes_of_a_path(isethdr_home):
    err = raised(ValueError("no lens in /data/\udce9.zmx"))  # a byte that is no UTF-8
    keep_traceback(err)
    [kept] = (isethdr_home / "failed").glob("*.txt")
    assert "/data/\\udce9.zmx" in kept.read_text(encoding="utf-8")
