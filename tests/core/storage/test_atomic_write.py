"""Files are complete or absent. The next writer removes temporary files of ended writers only."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path, write_text

KILLED = """
import os, signal, sys
from pathlib import Path
from isethdr_core.storage.atomic_write import write_text
Path.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
write_text(Path(sys.argv[1]), "half")
"""


def test_a_writer_killed_before_the_rename_leaves_a_name_that_the_next_one_removes(tmp_path):
    page = tmp_path / "key.html"
    assert subprocess.run([sys.executable, "-c", KILLED, str(page)], check=False).returncode < 0
    [left] = tmp_path.iterdir()
    assert left.name.startswith(".key.html.") and left.suffix == ".tmp"
    write_text(page, "whole")
    assert [p.name for p in tmp_path.iterdir()] == ["key.html"] and page.read_text() == "whole"


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    page = tmp_path / "key.html"
    write_text(page, "old")

    def full(*_, **__):
        raise OSError(28, "no space left")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="no space"):
        write_text(page, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["key.html"] and page.read_text() == "old"


def test_only_dead_writers_of_this_machine_are_cleaned_up(tmp_path):
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    mine = temporary_path(tmp_path, "a.zarr")
    mine.mkdir()
    of_child = mine.name.replace(f"-{os.getpid()}-", f"-{child.pid}-", 1)
    dead = tmp_path / of_child.replace("a.zarr", "b.zarr", 1)
    dead.mkdir()
    earlier = tmp_path / f".b.html.{socket.gethostname()}-{child.pid}-abcdef.tmp"
    earlier.touch()
    (dead / "zarr.json").write_text("{}")
    elsewhere = tmp_path / f".c.html.another-host-{child.pid}-abcdef.tmp"
    elsewhere.touch()
    # a machine whose name is that of this one, followed by a number
    numbered = tmp_path / f".d.html.{socket.gethostname()}-{child.pid}-{child.pid}-abcdef.tmp"
    numbered.touch()
    container = tmp_path / f".e.html.{socket.gethostname()}-{child.pid}-1-abcdef.tmp"
    container.touch()
    assert set(remove_leftovers(tmp_path)) == {dead, earlier}
    others = {elsewhere, numbered, container}
    assert set(tmp_path.iterdir()) == {mine, *others} and str(os.getpid()) in mine.name
