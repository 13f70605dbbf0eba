"""A whole run on a chart: the lens computes electrons directly where it may, and later runs reuse
stored kernels.
"""

import numpy as np
import pytest
from isethdr_optics.plan import planning
from isethdr_optics.psf import kernel_store, kernels
from isethdr_optics.psf.kernels import computing

import isethdr_core as hdr
from isethdr_core.storage import store

from .command import FAST

CHART = [
    "scene=point_lights",
    *(o for o in FAST if o != "lens=ideal"),
    "lens=diffraction_limited",
    "sensor=bayer",
    "~cameras",
    "scene.width=32",
    "scene.height=20",
]


def run(*overrides):
    return hdr.run(hdr.compose([*CHART, *overrides]))


def functionals(result):
    return [e.label for row in result.ledger for e in row.errors if "functionals" in e.label]


@pytest.fixture(autouse=True)
def every_kernel_is_kept(monkeypatch):
    monkeypatch.setattr(kernel_store, "WORTH_KEEPING_S", 0.0)
    monkeypatch.setattr(kernel_store, "PATTERN_WORTH_KEEPING_S", 0.0)
    monkeypatch.setattr(planning, "WORTH", 0)  # for frames of any size
    kernels.forget()
    yield
    kernels.forget()


@pytest.mark.slow  # three runs with diffraction
def test_another_exposure_reads_the_kernels_from_disk_and_gives_what_irradiance_gives(
    monkeypatch, isethdr_home
):
    first = run()
    assert len(functionals(first)) == 1
    assert len(list((isethdr_home / "kernels").glob("*.npy"))) == 1
    kernels.forget()  # as in a new process
    monkeypatch.setattr(computing, "computed", None)  # a call would fail
    second = run("sensor.exposure_s=0.008")
    assert second.key != first.key and len(functionals(second)) == 1
    # this `narrow` asks for no response, so the lens computes irradiance
    monkeypatch.setattr(
        "isethdr_sensors.imaging_sensor.ImagingSensor.narrow", lambda self, demand: demand
    )
    (isethdr_home / "runs").rename(isethdr_home / "kept")  # or the stored run would return
    long = run("sensor.exposure_s=0.008")
    assert not functionals(long)
    raw = np.asarray(long.open("captures/bayer").raw.values, int)
    kept = np.asarray(
        store.open_store(isethdr_home / "kept" / second.path.name, "captures/bayer").raw.values, int
    )
    # the random numbers are the same, and the means differ by a hundredth of the noise: one count
    # in a hundred may change by one
    assert np.abs(raw - kept).max() <= 2 and np.mean(raw != kept) < 0.05
