"""Frames, kernels and pixels that do not fit into memory are refused while a run is planned."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest

from isethdr_core import build, compose
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline import memory
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.plugins.registry import components
from isethdr_core.runs.run import run

CHART = [
    "scene=uniform",
    "scene.width=64",
    "scene.height=36",
    "scene.step_nm=100",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "lens=diffraction_limited",
    "~flare.dirt",
    "sensor=bayer",
]


@pytest.fixture
def no_work(monkeypatch):
    """Make every scene and renderer fail when it is called."""

    def work(*_):
        raise AssertionError("work has begun")

    for (kind, _), component in components().items():
        if kind in ("scene", "renderer"):
            monkeypatch.setattr(component.cls, "__call__", work)


def planned(*overrides):
    return plan(chain(compose([*CHART, *overrides])), Ledger())


def test_pixels_that_do_not_fit_are_refused_before_any_work(no_work, monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 4e8)
    too_fine = ["sensor.pitch_um=0.5"]
    for refused in (lambda: planned(*too_fine), lambda: run(compose([*CHART, *too_fine]))):
        # 2.9 mm x 1.6 mm of half a micrometre are 9.5 million pixels
        with pytest.raises(
            ConfigError,
            match=r"3275 x 5823 pixels of 0\.5 um.* bytes .*4e\+08 bytes .*type sensor\.pitch_um=",
        ):
            refused()


def test_a_pitch_that_is_advised_fits(monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 4e8)
    with pytest.raises(ConfigError) as refused:
        planned("sensor.pitch_um=0.5")
    planned(re.search(r"sensor\.pitch_um=[\d.]+", str(refused.value)).group())


RENDERED = [
    "scene=night_drive",
    "lighting=ideal",
    "~versions",
    "lens=diffraction_limited",
    "~flare.dirt",
    "sensor=bayer",
]


@pytest.mark.parametrize(("kind", "overrides"), [("scene", CHART), ("renderer", RENDERED)])
def test_a_frame_that_is_advised_fits(kind, overrides, monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 1e9)
    overrides = [*overrides, f"{kind}.width=5000", f"{kind}.height=3000", "sensor.pitch_um=40"]
    with pytest.raises(
        ConfigError, match=r"tiles.* would take .* bytes .* of this machine"
    ) as refused:
        plan(chain(compose(overrides)), Ledger())
    advised = re.findall(rf"{kind}\.(?:width|height)=\d+", str(refused.value))
    assert len(advised) == 2
    plan(chain(compose([*overrides, *advised])), Ledger())


@pytest.mark.parametrize("name", sorted(name for kind, name in components() if kind == "sensor"))
def test_every_sensor_counts_its_pixels(name):
    need = build("sensor", name, pitch_um=3.0).pixel_need(3e-3, 1.5e-3)
    assert need.what.startswith("500 x 1000 pixels")
    # one capture and its mask, at least
    assert need.size_bytes >= 500 * 1000 * (memory.FLOAT32_BYTES + 1)


def test_counted_tiles_are_those_that_are_made():
    scene = build("scene", "uniform", width=7, height=5)
    data = scene()
    assert isinstance(scene, memory.CountsTiles)
    assert scene.tile_counts(margin=True) == (data.sizes["y"], data.sizes["x"])


def kernel_bytes(lens, frame):
    """Return the bytes that a bundled lens states for its kernels."""
    return lens.held_bytes(frame, ())["point spread kernels"]


def test_kernels_take_what_was_counted():
    from isethdr_optics.psf import kernels
    from isethdr_optics.psf.kernels import KernelRequest

    lens = build("lens", "diffraction_limited")
    wave = (500.0, 600.0)
    frame = memory.Frame(90, 100, (1e-3, 1e-3), wave, sensed=False)
    counted = kernel_bytes(lens, frame)
    assert (
        counted
        > kernels.computed(KernelRequest(lens, (), np.array(wave), (4.0, 4.0), (89, 99))).held_bytes
        == 2 * 4 * 90 * 199  # half of each kernel; the other half is its mirror image
    )
    assert kernel_bytes(lens, replace(frame, sensed=True)) < counted
    assert kernel_bytes(build("lens", "ideal"), frame) == 0
    aberrated = build("lens", "wavefront", zernike_um={8: 0.05})
    assert kernel_bytes(aberrated, frame) > 2 * 4 * 179 * 199
    # the table covers both bands, which reach from 450 to 650 nm
    shifted = build("lens", "diffraction_limited", focal_shift_um={440.0: 20.0, 660.0: 0.0})
    assert kernel_bytes(shifted, frame) > 2 * 4 * 179 * 199


class Counting:
    """A scene of 3 x 4 tiles."""

    def tile_counts(self, margin):
        return 3, 4


@dataclass(frozen=True)
class Earlier:
    """A lens with the earlier method, `kernel_bytes`."""

    def kernel_bytes(self, frame, flares):
        return 5e9


class Current(Earlier):
    """A lens with both methods; the current one, `held_bytes`, counts."""

    def held_bytes(self, frame, flares):
        return {"ray tables": 4e9, "phase maps": 1e6}


def test_the_message_names_what_a_lens_says_that_it_holds(monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 1e9)
    frame = memory.Frame(3, 4, (1e-3, 1e-3), (500.0, 600.0), sensed=False)

    def check(lens):
        memory.check_run(Counting(), None, lens, (), (), frame)

    with pytest.raises(ConfigError, match=r"^ray tables of 2 bands over 3 x 4 tiles .* 4e\+09"):
        check(Current())
    with (
        pytest.warns(FutureWarning, match=r"Earlier\.kernel_bytes is now held_bytes"),
        pytest.raises(ConfigError, match=r"^arrays of the lens Earlier .* 5e\+09 bytes"),
    ):
        check(Earlier())


def test_wavefront_too_steep_for_any_pupil_is_refused_by_the_plan(no_work):
    with pytest.raises(ConfigError, match="smaller lens.zernike_um"):
        planned("lens=wavefront", "+lens.zernike_um={840:900.0}")


def test_control_groups_and_limits_of_the_process_count(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "CONTROL_GROUPS", tmp_path)
    monkeypatch.setattr(memory, "OWN_GROUPS", tmp_path / "own")
    job = tmp_path / "system.slice" / "job_7"
    old = tmp_path / "memory" / "job_7" / "step_0"
    job.mkdir(parents=True)
    old.mkdir(parents=True)
    (tmp_path / "memory.max").write_text("max\n")
    assert memory.machine_bytes() > 1e9, "no limit"
    (tmp_path / "own").write_text("4:cpu,memory:/job_7/step_0\n0::/system.slice/job_7\n")
    (job / "memory.max").write_text("12345678\n")
    assert memory.machine_bytes() == 12345678
    (job.parent / "memory.max").write_text("2345678\n")
    assert memory.machine_bytes() == 2345678, "limits hold for the groups below"
    (old.parent / "memory.limit_in_bytes").write_text("345678\n")
    assert memory.machine_bytes() == 345678
    (tmp_path / "own").unlink()
    (tmp_path / "memory" / "memory.limit_in_bytes").write_text("45678\n")
    assert memory.machine_bytes() == 45678, "a container sees its own group as the root"
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30));"
        "from isethdr_core.pipeline.memory import machine_bytes; print(machine_bytes())"
    )
    assert (
        float(
            subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, check=True
            ).stdout
        )
        <= 3 << 30
    )
