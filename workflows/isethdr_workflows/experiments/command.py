"""The command `isethdr experiments list|run|results`. Its modules are loaded when they are used."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Annotated

import typer

from isethdr_core.cli.terminal import print_path, print_table

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Repeat the published experiments: dataset, networks, studies.",
)
INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT
OUT_OF_TIME = 3  # exit code of a step that reached its limit


def _module(name: str) -> ModuleType:
    """Return a module of this folder. It is imported late, because `isethdr --help` does not need
    it.
    """
    return import_module(f"{__package__}.{name}")


@app.command("list", help="List the steps, their expected minutes, and which are done.")
def list_steps() -> None:
    """Print one row for each step."""
    steps = _module("steps")
    records = _module("records")
    rows = []
    for step in steps.STEPS:
        record = records.read(step)
        took = f"{record.minutes:.1f}" if record else ""
        state = "done" if records.is_finished(step) else "begun" if record else ""
        rows.append((step.name, step.about, f"{step.minutes:g}", step.basis, took, state))
    total = sum(step.minutes for step in steps.STEPS)
    print_table(["step", "what", "expected min", "basis", "took min", "state"], rows)
    print(
        f"all steps: about {total:.0f} min on two cores of a slow machine; no step takes more than"
        f" {steps.LONGEST_MIN:g} min at a time"
    )


@app.command(
    "run", help="Run the named steps, or all that are not done. Type it again to continue."
)
def run(
    names: Annotated[list[str] | None, typer.Argument(help="names of steps")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show the commands")] = False,
) -> None:
    """Run steps in their order."""
    steps = _module("steps")
    chosen = steps.steps_named(tuple(names or ()))
    driver = _module("driver")
    if dry_run:
        for step in chosen:
            print(f"{step.name}: about {step.minutes:g} min")
            for command in step.commands:
                print(f"  {driver.typed(command)}")
        return
    try:
        skipped = driver.run_steps(chosen)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    except driver.OutOfTime as limit:
        print(
            f"isethdr {limit} took {steps.LONGEST_MIN:g} min and was stopped; its results so far"
            " are kept; type the same command again to continue"
        )
        raise typer.Exit(OUT_OF_TIME) from None
    if skipped:
        print(f"left out: {', '.join(skipped)}")


@app.command("results", help="Write the tables of all finished steps on one page.")
def results() -> None:
    """Write the page."""
    print_path("results", _module("results").write_results())
