"""Cost of one shot of 1080 x 1920 pixels in three captures with all noise, against its least
possible work.

The least work is three NumPy Poisson draws of that size at a mean of 1000 electrons, plus the
projection of 31 bands onto three filters by one matrix product. Targets: at most 2 times their CPU
seconds, below 600 MB with the input, and the same bits for any blocks of rows and any number of
processes. Persistent maps of the device are made once and timed separately. One thread is used.
Run:

    python benchmarks/shot.py
"""

from __future__ import annotations

import os
import sys

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import hashlib
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

HEIGHT = 1080
WIDTH = 1920
BANDS = 31
LARGEST_RATIO = 2.0
LARGEST_MB = 600.0


def light():
    """Return irradiance float32 (wavelength, y, x) that makes 0.1 to 3e5 electrons, with one tile
    per pixel; it is made without a copy.
    """
    from isethdr_core.quantities import IRRADIANCE, centres, plane

    pitch = 2.8e-6
    values = np.empty((BANDS, HEIGHT, WIDTH), np.float32)
    values[:] = np.geomspace(3e-7, 1.0, WIDTH, dtype=np.float32)
    return plane(
        values,
        np.linspace(400, 700, BANDS),
        centres(WIDTH, WIDTH * pitch),
        centres(HEIGHT, HEIGHT * pitch),
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=np.pi / 65,
        falloff="none",
        field_width=WIDTH * pitch,
        field_height=HEIGHT * pitch,
    )


def cpu_seconds(call, repeats: int = 3) -> float:
    """Return the least CPU seconds of `repeats` calls."""
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        spent.append(time.process_time() - start)
    return min(spent)


def needed(values) -> tuple[float, float]:
    """Return CPU seconds of three Poisson draws and of the projection."""
    rng = np.random.default_rng(0)
    draws = cpu_seconds(lambda: [rng.poisson(1000.0, (HEIGHT, WIDTH)) for _ in range(3)])
    weights = np.ones((3, BANDS), np.float32)
    flat = values.reshape(BANDS, -1)
    return draws, cpu_seconds(lambda: weights @ flat)


def digest(rows: int) -> str:
    """Return the hash of a shot's numbers computed `rows` rows at a time."""
    from isethdr_sensors.readout.shot import readings

    from isethdr_core.plugins.registry import build
    from isethdr_core.seeds import generator

    model = build("sensor", "split_pixel").model()
    mean = np.broadcast_to(np.geomspace(0.1, 3e5, WIDTH), (HEIGHT // 4, WIDTH))
    raw, saturated = readings(model, [mean, mean * 0.01], generator(1), block_rows=rows)
    return hashlib.sha256(raw.tobytes() + saturated.tobytes()).hexdigest()


def peak_mb() -> float:
    """Return the peak memory of this process, MB."""
    # getrusage would also count the memory of the parent process: its peak survives the exec
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM:"))


def main() -> int:
    """Print the figures; return 1 if a target is missed."""
    from isethdr_core.plugins.registry import build
    from isethdr_core.seeds import generator

    sensor = build("sensor", "split_pixel")
    scene = light()
    start = time.process_time()
    sensor(scene, generator(0))
    first = time.process_time() - start
    peak = peak_mb()
    shot = cpu_seconds(lambda: sensor(scene, generator(1)))
    draws, projection = needed(scene.values)
    ratio = shot / (draws + projection)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        hashes = {*pool.map(digest, (1, 16, 270)), digest(15)}
    print(
        f"shot {shot:.3f} s (first of a device {first:.3f} s); three Poisson draws {draws:.3f} s,"
        f" projection {projection:.3f} s"
    )
    print(
        f"ratio {ratio:.2f} (target {LARGEST_RATIO:g}); peak {peak:.0f} MB with the input (target"
        f" {LARGEST_MB:g})"
    )
    print(
        "blocks of 1, 15, 16, 270 rows, three processes:"
        f" {'the same bits' if len(hashes) == 1 else 'DIFFERENT BITS'}"
    )
    return int(ratio > LARGEST_RATIO or peak > LARGEST_MB or len(hashes) > 1)


if __name__ == "__main__":
    sys.exit(main())
