"""Run the commands behind one page of docs/measured and write the page.

    python scripts/measured_pages.py             # list the pages and their commands
    python scripts/measured_pages.py stability   # run its commands, write its page
    python scripts/measured_pages.py paper_figures --measure paper_fig2

The page names the command, the date, the processor and the libraries. If a command fails, the page
stays unchanged. Some pages take hours; the list shows how long each command took.

The rows of commands that take hours are stored in scripts/stored_measurements, one file per page.
Such a page is made from these rows, and says when each command was run. `--measure WORD` first runs
the commands that contain a word, and stores their rows. The texts of the pages are in
`measured_page_texts.py`.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import platform
import re
import subprocess
import sys
import tempfile
import textwrap
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from measured_page_texts import PAGES, Column, Page

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ROOT / "docs" / "measured"
STORED = ROOT / "scripts" / "stored_measurements"
# the folders of an absolute path, which are removed because they belong to one machine
FOLDERS = re.compile(r"(?<![\w.:/])/(?:[\w.-]+/)+")
LIBRARIES = ("numpy", "scipy", "mitsuba")
# the command `isethdr` of this environment, which may not be the active one
ISETHDR = str(Path(sys.executable).with_name("isethdr"))


@dataclass(frozen=True)
class Measurement:
    """The stored rows of one command.

    Parameters
    ----------
    command : command that was run.
    measured : text of the page about date and machine.
    rows : CSV with a header.
    """

    command: str
    measured: str
    rows: str

    def as_toml(self) -> str:
        """Return the measurement as an entry of a TOML file."""
        head = f'[[measurement]]\ncommand = "{self.command}"\nmeasured = "{self.measured}"\n'
        return f"{head}rows = '''\n{self.rows.rstrip()}\n'''\n"


def main(arguments: list[str]) -> int:
    """Write the named pages, or list all pages."""
    parser = argparse.ArgumentParser(description="write pages of docs/measured")
    parser.add_argument("names", nargs="*", help="pages; none lists all of them")
    parser.add_argument("--measure", default="", help="run the stored commands with this word")
    asked = parser.parse_args(arguments)
    unknown = [name for name in asked.names if name not in PAGES]
    if unknown:
        print(f"no page {unknown[0]!r}; expected one of {', '.join(PAGES)}", file=sys.stderr)
        return 2
    if not asked.names:
        for name, page in PAGES.items():
            print(f"{name} ({page.takes}): {'; '.join(page.commands)}")
    for name in asked.names:
        page = PAGES[name]
        if page.is_stored and asked.measure:
            measure(name, [one for one in page.commands if asked.measure in one])
        text = page_text(name, page)
        (MEASURED / f"{name}.md").write_text(text)
        print(MEASURED / f"{name}.md")
    return 0


def page_text(name: str, page: Page) -> str:
    """Return the text of a page after its commands have been run, or from their stored rows.

    Raises
    ------
    subprocess.CalledProcessError : a command failed.
    """
    made_by = f"Made by `python scripts/measured_pages.py {name}`."
    if page.makes:
        title, _, rest = made_file(page).partition("\n\n")
        return f"{title}\n\n{made_by}\n\n{rest}"
    if page.is_stored:
        made_by = f"{made_by[:-1]} from stored rows; each table says when its rows were measured."
    parts = [f"# {page.title}", filled(made_by), filled(page.about)]
    if page.is_stored:
        stored = stored_measurements(name)
        for command in page.commands:
            parts += section_of(stored[command], page.columns)
            parts += [filled(paragraph) for paragraph in page.below.get(command, ())]
    else:
        when = f"Measured on {datetime.now(UTC):%Y-%m-%d}, {machine()}."
        parts.append(filled(when))
        for command in page.commands:
            parts += [f"## `{command}`", result_of(command, page.columns)]
            parts += [filled(paragraph) for paragraph in page.below.get(command, ())]
    parts += [filled(note) for note in page.notes]
    return "\n\n".join(parts) + "\n"


def filled(paragraph: str) -> str:
    """Return a paragraph in lines of at most 100 columns; an image, a table or a heading stays as
    it is.
    """
    if paragraph.startswith(("![", "|", "#")):
        return paragraph
    return textwrap.fill(paragraph, 100, break_on_hyphens=False, break_long_words=False)


def section_of(measurement: Measurement, columns: Mapping[str, Column]) -> list[str]:
    """Return the parts of a page that show a stored measurement.

    Parameters
    ----------
    measurement : measurement with its rows.
    columns : formats of columns, by name.
    """
    rows = list(csv.DictReader(measurement.rows.strip().splitlines()))
    when = filled(f"Measured {measurement.measured}.")
    return [f"## `{measurement.command}`", when, markdown(rows, columns)]


def stored_measurements(name: str) -> dict[str, Measurement]:
    """Return the stored measurements of a page, by command."""
    path = STORED / f"{name}.toml"
    if not path.exists():
        return {}
    entries = tomllib.loads(path.read_text())["measurement"]
    return {entry["command"]: Measurement(**entry) for entry in entries}


def measure(name: str, commands: Sequence[str]) -> None:
    """Run commands of a page in the user's own home, and store their rows.

    Parameters
    ----------
    name : name of the page.
    commands : commands that begin with `isethdr study` or `python -m isethdr_measured`.

    Raises
    ------
    subprocess.CalledProcessError : a command failed.
    """
    stored = stored_measurements(name)
    for command in commands:
        rows = csv_of(command, dict(os.environ))
        when = f"on {datetime.now(UTC):%Y-%m-%d}, {machine()}"
        stored[command] = Measurement(command, when, rows)
    entries = [stored[one].as_toml() for one in PAGES[name].commands if one in stored]
    (STORED / f"{name}.toml").write_text("\n".join(entries))


def made_file(page: Page) -> str:
    """Run the command of a page, and return the text of the file that it makes in the user's home.

    Raises
    ------
    subprocess.CalledProcessError : the command failed.
    """
    [command] = page.commands
    subprocess.run([ISETHDR, *command.split()[1:]], cwd=ROOT, check=True)
    home = Path(os.environ.get("ISETHDR_HOME", ROOT / "runs"))
    return (home / page.makes).read_text()


def machine() -> str:
    """Return the processor, its load, and the versions of the main libraries."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].partition(":")[2].strip() if lines else model
    versions = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    cores = os.cpu_count()
    load = os.getloadavg()[0]
    return f"{model}, {cores} cores with a load of {load:.1f} at the end; {versions}"


def result_of(command: str, columns: Mapping[str, Column]) -> str:
    """Return the output of a command: a table for a study, a code block for other commands.

    A table in Markdown that a script prints is returned unchanged; such a script prints nothing
    else.

    Parameters
    ----------
    command : command to run.
    columns : formats of the columns of a study, by name.
    """
    words = command.split()
    if study_words(words):
        with tempfile.TemporaryDirectory() as folder:
            rows = csv_of(command, os.environ | {"ISETHDR_HOME": folder})
        return markdown(list(csv.DictReader(rows.splitlines())), columns)
    done = subprocess.run([sys.executable, *words[1:]], cwd=ROOT, capture_output=True, text=True)
    # 1 means that a target is missed, which the output states; a crash may have printed nothing
    if done.returncode > 1 or not done.stdout.strip():
        done.check_returncode()
    text = done.stdout.strip("\n")
    return text if text.startswith("|") else f"```text\n{text}\n```"


def study_words(words: Sequence[str]) -> list[str]:
    """Return the words that run a study in this environment; an empty list for other commands."""
    if words[:2] == ["isethdr", "study"]:
        return [ISETHDR, *words[1:]]
    if words[:3] == ["python", "-m", "isethdr_measured"]:
        return [sys.executable, *words[1:]]
    return []


def csv_of(command: str, environment: Mapping[str, str]) -> str:
    """Run a study and return its rows as CSV.

    Parameters
    ----------
    command : command of the study.
    environment : variables of the process, including the home.

    Raises
    ------
    subprocess.CalledProcessError : the study failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        rows = Path(folder) / "rows.csv"
        run = [*study_words(command.split()), "--csv", str(rows)]
        subprocess.run(run, cwd=ROOT, check=True, env=environment, stdout=subprocess.DEVNULL)
        return rows.read_text()


def markdown(rows: list[dict[str, str]], shown: Mapping[str, Column]) -> str:
    """Return rows as a Markdown table.

    Parameters
    ----------
    rows : rows of one command, all with the same columns.
    shown : formats of columns, by name.
    """
    names = [name for name in rows[0] if shown.get(name, Column()).shown]
    headings = [shown.get(name, Column()).heading or name for name in names]
    lines = [f"| {' | '.join(headings)} |", "|" + "---|" * len(headings)]
    for row in rows:
        plain = [FOLDERS.sub("", short(row, name, shown.get(name, Column()))) for name in names]
        cells = [value.replace("|", "\\|").replace("\n", " ") for value in plain]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def short(row: Mapping[str, str], name: str, column: Column) -> str:
    """Return one value of a row: a number with the digits of its column, other text unchanged.

    Parameters
    ----------
    row : values by the name of their column.
    name : name of the column.
    column : format of the column.
    """
    text = row[name]
    try:
        value = float(text)
        error = float(row[column.error]) if column.error else 0.0
    except ValueError:
        return text
    if not math.isfinite(value) or not ("." in text or "e" in text):
        return text
    if 0 < error < math.inf:
        value = round(value, 1 - math.floor(math.log10(error)))
    return f"{value:.{column.digits}g}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
