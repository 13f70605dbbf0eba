"""Slow lenses and fine tiles: the pattern is far wider than a tile, often wider than the frame."""

import re
import subprocess
import sys
from pathlib import Path
from time import process_time

import numpy as np
import pytest
from isethdr_optics.psf import exact_core, kernels, wings
from isethdr_optics.psf.kernels import KernelRequest, core_size
from isethdr_optics.psf.kernels.lattices import of_lattices
from scipy.special import j1

from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.memory import Frame
from isethdr_core.plugins.registry import build

GREEN = np.array([550.0])


def refuse_lattices(monkeypatch):
    def refused(*_, **__):
        raise AssertionError("a lattice was made where the exact core covers the frame")

    monkeypatch.setattr(wings, "shared", refused)
    monkeypatch.setattr(wings, "own", refused)


def airy(f_number: float, pitch_um: float, reach) -> np.ndarray:
    """Return the intensity at tile centres times a tile's area (Airy 1835)."""
    y, x = (np.arange(-r, r + 1) * pitch_um for r in reach)
    v = np.pi * np.hypot(y[:, None], x) / (0.55 * f_number) + 1e-9
    return (2 * j1(v) / v) ** 2 * np.pi / 4 * (pitch_um / (0.55 * f_number)) ** 2


@pytest.mark.parametrize(
    ("f_number", "pitch_um", "reach"),
    [
        (100.0, 3.0, (15, 15)),
        (200.0, 3.0, (15, 15)),
        (256.0, 0.7, (20, 30)),
        (4.0, 0.125, (128, 128)),
        (100.0, 3.0, (134, 239)),
    ],
)
def test_exact_core_alone_serves_patterns_wider_than_tiles(f_number, pitch_um, reach, monkeypatch):
    refuse_lattices(monkeypatch)
    lens = build("lens", "diffraction_limited", f_number=f_number)
    made = kernels.computed(KernelRequest(lens, (), GREEN, (pitch_um, pitch_um), reach))
    # 5e-3 of the peak: averaging over a tile lowers the peak by (pi pitch / (wavelength N))^2 / 12,
    # which is 4e-3 for the widest tile here
    np.testing.assert_allclose(
        made.bands[0] / made.bands[0].max(),
        airy(f_number, pitch_um, reach) / made.bands[0].max(),
        atol=5e-3,
    )
    # the only error is that of a core from one pattern
    assert made.speckle.max() == exact_core.PATTERN_ERROR and made.wrap == 0


def test_wavefront_of_a_slow_lens_needs_no_lattice_either(monkeypatch):
    refuse_lattices(monkeypatch)
    slow = kernels.computed(
        KernelRequest(
            build("lens", "wavefront", f_number=200.0, zernike_um={4: 0.1}),
            (),
            GREEN,
            (3.0, 3.0),
            (15, 15),
        )
    ).bands[0]
    # with f-number and tiles both scaled by 50, the pattern is the same (Fraunhofer diffraction)
    same = kernels.computed(
        KernelRequest(
            build("lens", "wavefront", f_number=4.0, zernike_um={4: 0.1}),
            (),
            GREEN,
            (0.06, 0.06),
            (15, 15),
        )
    ).bands[0]
    np.testing.assert_allclose(slow, same, rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "tiles", "pitch_um"), [("diffraction_limited", 64, 1000.0), ("wavefront", 1000, 30.0)]
)
def test_frames_too_wide_for_a_fast_lens_are_refused_before_work(name, tiles, pitch_um):
    fast = {"f_number": 0.5, **({"zernike_um": {4: 0.1}} if name == "wavefront" else {})}
    start = process_time()
    with pytest.raises(ConfigError) as refused:
        kernels.kernels(
            KernelRequest(
                build("lens", name, **fast), (), GREEN, (pitch_um, pitch_um), (tiles - 1, tiles - 1)
            )
        )
    frame = Frame(tiles, tiles, (1e-3 * pitch_um / 4, 1e-3 * pitch_um / 4), (550.0,), sensed=False)
    with pytest.raises(ConfigError, match=r"lens\.f_number=") as planned:
        build("lens", name, **fast).held_bytes(frame, ())
    at_work, advised = (
        float(re.search(r"lens\.f_number=([\d.]+)", str(r.value)).group(1))
        for r in (refused, planned)
    )
    assert advised >= at_work  # a plan that is accepted is not refused at work
    accepted = build("lens", name, **fast | {"f_number": advised})
    assert accepted.held_bytes(frame, ())["point spread kernels"] > 0
    # 0.4 s with imports; a pupil of 400,000 cells and more across would take far longer
    assert process_time() - start < 4.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diffraction_limited", "wavefront"])
def test_lattices_of_slow_lenses_are_right_to_what_they_state(name, monkeypatch):
    lens = build(
        "lens", name, f_number=100.0, **({"zernike_um": {8: 0.05}} if name == "wavefront" else {})
    )
    exact = kernels.computed(
        KernelRequest(lens, (), GREEN, (3.0, 3.0), (134, 239), width_nm=np.array([10.0]))
    ).bands[0]
    monkeypatch.setattr(core_size, "CORE_TILES", 0)
    monkeypatch.setattr(core_size, "CORE_SAMPLES", 60)
    made = of_lattices(
        KernelRequest(lens, (), GREEN, (3.0, 3.0), (134, 239), width_nm=np.array([10.0]))
    )
    outer = np.ones(exact.shape, bool)
    outer[134 - 60 : 134 + 61, 239 - 60 : 239 + 61] = False
    assert np.abs(made.bands[0] - exact)[outer].sum() < made.speckle.max() * exact[outer].sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("f_number", "tiles", "pitch_um"), [(4.0, 129, 0.125), (100.0, 16, 3.0), (200.0, 16, 3.0)]
)
def test_small_frames_take_little_time_and_memory(f_number, tiles, pitch_um):
    code = (
        "import sys; from time import process_time;"
        f" sys.path.insert(0, {str(Path(__file__).parents[1])!r});"
        " from peak_memory import peak_bytes;"
        " from isethdr_core.plugins.registry import build;"
        " import isethdr_optics.psf.kernels as k; start = process_time();"
        f" lens = build('lens', 'diffraction_limited', f_number={f_number});"
        f" k.computed(k.KernelRequest(lens, (), [550.0], ({pitch_um},) * 2, ({tiles - 1},) * 2));"
        " print(process_time() - start, peak_bytes())"
    )
    seconds, peak = map(
        float,
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split(),
    )
    # 0.3 s and 0.13 GB in addition to the imports; with lattices it would be 24 s and 4.3 GB
    assert seconds < 5 and peak < 2**30
