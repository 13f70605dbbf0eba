"""The action of `isethdr train picture`, and its output.

PyTorch is imported after the settings are checked.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from isethdr_core.cli.terminal import print_path, print_table

from .settings import parsed

INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT


def train_picture(typed: Sequence[str]) -> int:
    """Train, print the held-out results, and return the exit code.

    Parameters
    ----------
    typed : settings as typed, key=value: those of the training, and overrides of the config.
    """
    settings, overrides = parsed(typed)
    training = import_module(".training", __package__)  # PyTorch takes seconds to import
    finish = import_module(".finish", __package__)
    if settings.loss == "view":
        print(f"loss=view: {finish.LOSSES['view']}")
    try:
        run = training.trained(settings, overrides, print)
        if run.progress.stopped:
            print(f"stopped: {run.progress.stopped}")
        result = finish.finished(run, training.recipe_text(settings, overrides), print)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue", file=sys.stderr)
        return INTERRUPTED
    cells = [[f"{value:.4g}" for value in row.values()] for row in result.rows]
    print_table(result.rows[0], cells, "held-out pictures")
    for path in (result.model, *result.card):
        print_path("stored", path)
    return 0
