"""The share of error estimates in a run: CPU seconds of noise realisations, score intervals and
picture errors over those of everything after the radiance.

The error estimates ("machinery") are the ledger rows `draws`, `scores` and `picture`. A run with
one noise realisation, without intervals of scores and without stated errors of pictures would not
need them. The first realisation, its scores and the reference pictures belong to the run itself.

Cameras run one after another on one thread, because rows that run at the same time cannot be timed
apart. The radiance is read from its store, or rendered first. Kernels of the lens are read from
disk, or made. The noise has a new seed, so that no later result is found in a store. Run:

    python benchmarks/truth_machinery.py [overrides of the config]
"""

from __future__ import annotations

import os
import random
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from unittest import mock

MACHINERY = ("draws", "scores", "picture")
BEFORE = ("plan", "scene", "renderer", "store", "radiance")


class Clock:
    """CPU seconds of this process per kind of ledger row, and those at which the radiance and the
    store were complete.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.radiance_s = 0.0
        self.stored_s = 0.0
        self._running = 0

    def watch(self, stage):
        """Return `ledger.stage` with its outermost rows timed."""

        @contextmanager
        def timed(rows, title: str) -> Iterator:
            start = time.process_time()
            self._running = self._running + 1
            try:
                with stage(rows, title) as row:
                    yield row
            finally:
                self._running -= 1
                if not self._running:
                    self._add(title.partition(" ")[0], time.process_time() - start)

        return timed

    def _add(self, kind: str, seconds: float) -> None:
        self.seconds[kind] = self.seconds.get(kind, 0.0) + seconds
        if kind in BEFORE:
            self.radiance_s = time.process_time()

    def stored(self, write_store):
        """Return `write_store` with its end recorded in `stored_s`."""

        def timed(*args, **options):
            path = write_store(*args, **options)
            self.stored_s = time.process_time()
            return path

        return timed


def main() -> None:
    """Run the main job with the overrides of the command line, and print its shares."""
    os.environ["OMP_NUM_THREADS"] = "1"
    import isethdr_core as hdr
    from isethdr_core.storage import store
    from isethdr_core.uncertainty import ledger

    clock = Clock()
    # the module needs its full path, because `isethdr_core.run` is a function
    import_module("isethdr_core.runs.run")
    config = hdr.compose([f"seed={random.SystemRandom().randrange(2**31)}", *sys.argv[1:]])
    with (
        mock.patch.object(ledger, "stage", clock.watch(ledger.stage)),
        mock.patch.object(store, "write_store", clock.stored(store.write_store)),
    ):
        hdr.run(config)
    end_s = time.process_time()
    machinery = sum(clock.seconds.get(kind, 0.0) for kind in MACHINERY)
    for kind, seconds in clock.seconds.items():
        print(f"{kind:10s} {seconds:7.2f}" + ("  machinery" if kind in MACHINERY else ""))
    to_store = clock.stored_s - clock.radiance_s
    to_end = end_s - clock.radiance_s
    print(f"\nmachinery: {machinery:.2f} CPU s")
    print(f"radiance to written store: {to_store:.2f} CPU s, share {machinery / to_store:.3f}")
    print(f"radiance to end, with the report: {to_end:.2f} CPU s, share {machinery / to_end:.3f}")


if __name__ == "__main__":
    main()
