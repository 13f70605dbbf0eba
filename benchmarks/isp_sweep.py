"""CPU seconds of a sweep over isp settings, against those of the isp and the metrics alone.

The job is the main job with its radiance stored, and without intermediate results from earlier
runs. The runs of the sweep are whole runs: three cameras, four noise realisations, intervals of
scores, a store each, no report. In the same runs the CPU seconds inside the isp and the metrics are
counted, which every setting needs: those of the noise realisations, and those of the changed scenes
by which intervals include renderer noise. All other seconds, also those for light and captures in
the first run, are overhead. Cameras run one after another on one thread, because calls that run at
the same time cannot be timed apart. Target: the whole sweep takes at most 1.5 times the needed
seconds. Run:

    python benchmarks/isp_sweep.py                  # 20 settings, the main job's frame
    python benchmarks/isp_sweep.py --settings 6 --width 192 --height 108 --samples 16

Radiance that is not stored in ISETHDR_HOME is rendered first and not counted.
"""

from __future__ import annotations

import argparse
import os
import shutil
import time
from collections import Counter
from contextlib import contextmanager

LARGEST_RATIO = 1.5
FIELDS = {  # every combination makes other pictures
    "rule": ("inverse_variance", "average", "poisson_sum", "isetcam"),
    "design_snr": (5.0, 10.0, 20.0, 40.0, 80.0),
}


class Clock:
    """CPU seconds inside the isp and the metrics, by purpose."""

    def __init__(self) -> None:
        self.spent_s: Counter[str] = Counter()
        self.purpose = "realisations"
        self.depth = 0

    def timed(self, cls: type, method: str) -> None:
        """Count the seconds of the calls of a component's method; nested calls count once."""
        call = getattr(cls, method)

        def counted(component, *arguments, **named):
            start = time.process_time()
            self.depth += 1
            try:
                return call(component, *arguments, **named)
            finally:
                self.depth -= 1
                if not self.depth:
                    self.spent_s[self.purpose] += time.process_time() - start

        setattr(cls, method, counted)

    @contextmanager
    def on(self, purpose: str):
        """Count the calls inside the context for another purpose."""
        before = self.purpose
        self.purpose = purpose
        try:
            yield
        finally:
            self.purpose = before


def settings(count: int) -> list[list[str]]:
    """Return the overrides of the first `count` settings, isps that differ in two fields."""
    pairs = [(rule, snr) for snr in FIELDS["design_snr"] for rule in FIELDS["rule"]]
    return [[f"isp.rule={rule}", f"isp.design_snr={snr}"] for rule, snr in pairs[:count]]


def frame(chosen_height) -> list[str]:
    """Return the overrides of a smaller frame than the main job's."""
    asked = {
        "width": chosen_height.width,
        "height": chosen_height.height,
        "samples": chosen_height.samples,
    }
    return [f"renderer.{name}={value}" for name, value in asked.items() if value]


def render(overrides: list[str]) -> None:
    """Store the radiance of the job, unless it is stored already."""
    import isethdr_core as hdr
    from isethdr_core.pipeline.chain import chain, plan
    from isethdr_core.runs.radiance_cache import scene_radiance
    from isethdr_core.uncertainty.ledger import Ledger

    config = hdr.compose(overrides)
    rows = Ledger()
    parts = chain(config)
    scene_radiance(parts, plan(parts, rows), rows, config)


def methods_of(component) -> list[tuple[type, str]]:
    """Return the methods of an isp or a metric that a run calls, with their class."""
    from isethdr_core.plugins.protocols import ScoresFurther, ScoresParts

    methods = ["__call__"]
    if isinstance(component, ScoresFurther):  # another realisation of the noise
        methods.append("further")
    if isinstance(component, ScoresParts):  # parts of a picture
        methods.append("of_parts")
    return [(type(component), method) for method in methods]


def watched(overrides: list[str]) -> Clock:
    """Return the clock of all isps and metrics of the job."""
    import isethdr_core as hdr
    from isethdr_core.pipeline.chain import chain
    from isethdr_core.uncertainty import score_errors

    clock = Clock()
    parts = chain(hdr.compose(overrides))
    for cls, method in {
        called for one in (parts.isp, *parts.metrics.values()) for called in methods_of(one)
    }:
        clock.timed(cls, method)
    of_each = score_errors.of_each

    def of_changed_scenes(*arguments, **named):
        with clock.on("changed scenes"):
            return of_each(*arguments, **named)

    score_errors.of_each = of_changed_scenes
    return clock


def main() -> None:
    """Run the sweep and print its CPU seconds."""
    reading = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, default in (("settings", 20), ("width", 0), ("height", 0), ("samples", 0)):
        reading.add_argument(f"--{name}", type=int, default=default)
    options = reading.parse_args()

    os.environ["OMP_NUM_THREADS"] = "1"
    import isethdr_core as hdr
    from isethdr_core.runs.reuse import FOLDER
    from isethdr_core.storage.home_folder import home

    job = [*frame(options), "report=false"]
    render(job)
    shutil.rmtree(home() / FOLDER, ignore_errors=True)
    clock = watched(job)
    all_s = []
    for overrides in settings(options.settings):
        start = time.process_time()
        before_s = sum(clock.spent_s.values())
        result = hdr.run(hdr.compose([*job, *overrides]))
        if not result.computed:
            raise SystemExit(f"{result.path} is stored already; choose an empty ISETHDR_HOME")
        all_s.append(time.process_time() - start)
        own_s = sum(clock.spent_s.values()) - before_s
        print(f"{' '.join(overrides):48s} {all_s[-1]:6.1f} CPU s, needed {own_s:.1f}", flush=True)
    needed_s = sum(clock.spent_s.values())
    ratio = sum(all_s) / needed_s
    print(f"sweep of {len(all_s)} settings      {sum(all_s):8.1f} CPU s")
    for purpose, spent_s in clock.spent_s.items():
        print(f"isp and metrics, {purpose:14s} {spent_s:6.1f} CPU s")
    if len(all_s) > 1:
        further = sum(all_s[1:]) / (len(all_s) - 1)
        print(f"first setting {all_s[0]:.1f} CPU s, each further one {further:.1f}")
    verdict = "met" if ratio <= LARGEST_RATIO else "not met"
    print(f"ratio {ratio:.2f}, at most {LARGEST_RATIO}: {verdict}")
    print(f"ratio to the noise realisations alone {sum(all_s) / clock.spent_s['realisations']:.2f}")


if __name__ == "__main__":
    main()
