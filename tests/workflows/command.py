"""Start `isethdr` as users do, in separate processes, on charts that take a second."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from isethdr_core.cli.commands import main

FAST = [
    "scene.width=48",
    "scene.height=27",
    "scene.horizontal_field_deg=8",  # a small field needs a small sensor
    "draws=1",
    "~renderer",
    "~versions",
    "lens=ideal",
    "~flare@flare.dirt",
    "isp=linear",
    *(
        f"~metric.{name}"
        for name in (
            *("shares", "dynamic_range", "snr", "colour", "ssim", "log_luminance"),
            "detection",
        )
    ),
]
# all plugins but the one that writes report pages: plots take as long as everything else
WITHOUT_REPORT = "core,scenes,mitsuba,optics,sensors,isp,metrics,workflows,acme"
LIGHTS = ["scene=point_lights", *FAST]  # two light groups: sky and headlights


def environment(plugins, variables) -> dict[str, str]:
    """Return the environment of a command, with the folders `plugins` on its path."""
    paths = [*map(str, plugins), os.environ.get("PYTHONPATH", "")]
    return {
        **os.environ,
        "ISETHDR_PLUGINS": WITHOUT_REPORT,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "COLUMNS": "200",
        "NO_COLOR": "1",
        **variables,
    }


def start(*arguments: str, plugins=(), **variables: str) -> subprocess.Popen:
    """Return the started command, in a process group of its own, so that Ctrl-C reaches it
    alone.
    """
    # a shell makes its background processes ignore Ctrl-C (SIGINT); this restores the default
    return subprocess.Popen(
        [sys.executable, "-c", "from isethdr_core.cli.commands import main; main()", *arguments],
        env=environment(plugins, variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def isethdr(*arguments: str, plugins=(), **variables: str) -> subprocess.CompletedProcess:
    """Return the finished command."""
    process = start(*arguments, plugins=plugins, **variables)
    out, err = process.communicate(timeout=600)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


ONE_BY_ONE = """
import contextlib, io, json, sys
from isethdr_core.cli.commands import main
ends = []
for arguments in json.loads(sys.argv[1]):
    sys.argv, said, code = ["isethdr", *arguments], io.StringIO(), 0
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            main()
        except SystemExit as end:
            code = end.code
    ends.append([code, said.getvalue()])
print(json.dumps(ends))
"""


def one_by_one(*commands: list[str], plugins=(), **variables: str) -> list[tuple[int, str]]:
    """Run all commands in one process, because start-up takes a second, and return (exit code,
    standard error) of each.
    """
    done = subprocess.run(
        [sys.executable, "-c", ONE_BY_ONE, json.dumps(commands)],
        capture_output=True,
        text=True,
        check=False,
        env=environment(plugins, variables),
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def here(monkeypatch, capsys, *arguments: str) -> tuple[int, str]:
    """Run a command in the test's own process, where it needs no other one, and return (exit code,
    standard error).
    """
    monkeypatch.setattr(sys, "argv", ["isethdr", *arguments])
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # Ctrl-C stays with the tests
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, capsys.readouterr().err


def installed_trouble(folder: Path) -> Path:
    """Install the plugin package `acme_trouble` into `folder`, with its entry point, and return the
    folder.
    """
    info = folder / "acme_trouble-1.0.dist-info"
    info.mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("trouble.py"), folder / "acme_trouble.py")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme_trouble\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[isethdr]\nacme = acme_trouble\n")
    return folder


def wait_for(path: Path, process: subprocess.Popen) -> None:
    """Return once `path` exists; fail if the process ends before that, or after ten minutes."""
    limit = time.monotonic() + 600
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < limit, f"{path.name} did not come"
        time.sleep(0.02)


def stores(home: Path) -> dict[str, int]:
    """Return the time at which each store of a home was written, by its name."""
    return {
        p.name: (p / "zarr.json").stat().st_mtime_ns
        for kind in ("runs", "scenes")
        for p in (home / kind).glob("*.zarr")
    }


def leftovers(home: Path) -> list[str]:
    """Return the names of half-written stores."""
    return [p.name for kind in ("runs", "scenes") for p in (home / kind).glob(".*")]


def error_lines(done: subprocess.CompletedProcess) -> list[str]:
    """Return the lines that the command wrote to standard error."""
    return done.stderr.strip().splitlines()
