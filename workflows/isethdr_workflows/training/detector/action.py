"""The action of `isethdr train detector`, and its output. PyTorch is imported after the settings
are checked.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.extras import needed

from .settings import parsed

INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT


def train_detector(typed: Sequence[str]) -> int:
    """Train, print the held-out scores, and return the exit code.

    Parameters
    ----------
    typed : settings as typed, key=value: those of the training, and overrides of the config.
    """
    settings, overrides = parsed(typed)
    # needed for the scores after the training; a user should not learn this only then
    with needed("the training of a detector", extra="detect"):
        import_module("hotcoco")
    training = import_module(".training", __package__)  # PyTorch takes seconds to import
    export = import_module(".export", __package__)
    try:
        run = training.trained(settings, overrides, print)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue", file=sys.stderr)
        return INTERRUPTED
    if run.progress.stopped:
        print(f"stopped: {run.progress.stopped}")
    detector = export.exported(run, training.recipe_text(settings, overrides))
    rows = export.held_out_rows(detector, run.data.held_out)
    print_table(list(rows[0]), [list(row.values()) for row in rows], "held-out roads")
    for title, name in (("detector", export.DESCRIPTION), ("card", "card.md")):
        print_path(title, run.folder / name)
    print("next: isethdr study detector_scores")
    return 0
