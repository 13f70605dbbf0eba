"""Run isethdr in separate processes, with plugin packages made for one test."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from isethdr_core.cli.commands import main

EXAMPLE = Path(__file__).parents[1] / "example_plugin"


def isethdr(
    *arguments: str, plugins=(), code: str | None = None, **variables: str
) -> subprocess.CompletedProcess:
    """Return the finished command `isethdr <arguments>`, or `python -c code`, with the folders
    `plugins` on its path.
    """
    paths = [*map(str, plugins), os.environ.get("PYTHONPATH", "")]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "COLUMNS": "200",
        "NO_COLOR": "1",
        **variables,
    }
    command = [
        sys.executable,
        "-c",
        code or "from isethdr_core.cli.commands import main; main()",
        *arguments,
    ]
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=600, check=False
    )


def here(monkeypatch, capsys, *arguments: str) -> tuple[int, str, str]:
    """Return (exit code, output, standard error) of `isethdr <arguments>`, run in this process.

    This saves the second that a new process takes to start. Use `isethdr` above where the test
    needs a new process.
    """
    monkeypatch.setattr(sys, "argv", ["isethdr", *arguments])
    code = 0
    try:
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def write_plugin(
    folder: Path, package: str, source: str, entry_point: str = "", **modules: str
) -> Path:
    """Write an installed package of one module, with its entry point, into `folder`, and return the
    folder.
    """
    (folder / f"{package}.py").write_text(source)
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text)
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[isethdr]\n{entry_point or package} = {package}\n")
    return folder
