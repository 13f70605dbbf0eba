"""A sweep whose runs are stores without pictures, made in milliseconds."""

from __future__ import annotations

from pathlib import Path

from isethdr_core.runs.labels import Labels, add_labels
from isethdr_core.storage.store import write_store
from isethdr_core.sweeps.record import Job, Sweep, begin, write_job

# sensor, exposure in s, SSIM with its interval, and score of an unknown metric of each job
JOBS = (
    ("bayer", "0.004", (0.50, 0.48, 0.52), 3.0),
    ("bayer", "0.016", (0.60, 0.58, 0.62), 1.0),
    ("rgbw", "0.016", (0.61, 0.59, 0.63), 2.0),
)
NAN = float("nan")


def stored_sweep(home: Path, name: str = "exposures", failed: bool = False) -> Sweep:
    """Store the runs of a sweep with one camera, and return the sweep; `failed` adds a job."""
    overrides = ("sensor=bayer,rgbw", "sensor.exposure_s=0.004,0.016")
    sweep = Sweep(name, overrides, ("sensor", "sensor.exposure_s"), 4, started=1000.0)
    begin(sweep)
    for number, (sensor, exposure, ssim, vividness) in enumerate(JOBS):
        key = f"{name}{number}"
        typed = (f"sensor={sensor}", f"sensor.exposure_s={exposure}")
        path = write_store(home / "runs", key, {}, attributes(key, sensor, ssim, vividness))
        path.with_suffix(".html").write_text("a report")
        add_labels(path, Labels(tags=("wet",), sweeps=(name,)))
        write_job(sweep.folder, Job(number, typed, 2.0, key, computed=True))
    if failed:
        typed = ("sensor=rgbw", "sensor.exposure_s=0.004")
        write_job(sweep.folder, Job(3, typed, 1.0, error="glass broke"))
    return sweep


def attributes(key: str, camera: str, ssim: tuple[float, ...], vividness: float) -> dict:
    """Return the root attributes of a run with two scores of the frame and one of an object."""
    rows = [("ssim", "", "", *ssim), ("vividness", "vv", "", vividness, NAN, NAN)]
    rows.append(("ssim", "", "deer 1", 0.99, NAN, NAN))
    names = ("metric", "unit", "object", "value", "low", "high")
    scores = [{"camera": camera, **dict(zip(names, row))} for row in rows]
    return {
        "kind": "run",
        "key": key,
        "cameras": [camera],
        "scores": scores,
        "config": {"scene": {"name": "chart"}, "sensor": {"name": camera}},
        "lighting": "ideal",
        "ledger": [],
    }
