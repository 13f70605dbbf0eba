"""Sub-bands of a point spread are left out if and only if they change nothing."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest, band_plan, lookup

from isethdr_core import build

LENS = build("lens", "diffraction_limited", f_number=4.0, focal_length_mm=4.0)
# one band from 525 to 575 nm, and the ten that it is made of
BAND = [500.0, 550.0, 600.0]
PARTS = np.arange(527.5, 573.0, 5.0)


@pytest.fixture
def used(monkeypatch):
    """How many wavelengths each band's core was made of, band by band."""
    found = []
    made = band_plan.exact_core

    def core(plan, centre, width, waves, energy):
        found.append(len(waves))
        return made(plan, centre, width, waves, energy)

    monkeypatch.setattr(band_plan, "exact_core", core)
    monkeypatch.setattr(lookup, "_cache", type(lookup._cache)())
    # a slow machine writes kernels to disk
    monkeypatch.setattr(lookup, "stored", lambda name: None)
    return found


def tiles(wavelength_nm, reach):
    return [
        np.asarray(band, float)
        for band in kernels.kernels(
            KernelRequest(LENS, (), wavelength_nm, (1.0, 1.0), (reach, reach))
        ).bands
    ]


@pytest.mark.parametrize("reach", [12, 60])
def test_a_band_is_the_mean_of_its_parts(used, reach, monkeypatch):
    """Three wavelengths do for a band as long as the pattern at the kernel's border moves by less
    than a speckle from one to the next.
    """
    few = tiles(BAND, reach)[1]
    parts = np.mean(tiles(PARTS, reach), axis=0)
    assert used[:3] == [3, 3, 3] and len(used) == 3 + len(PARTS) and sum(used[3:]) == 30
    # of a point's light, in all tiles together: measured 0.0005 and 0.0011, what rings at the
    # border make of midpoints
    left = np.abs(few - parts).sum()
    assert left < 0.0015 and few.sum() == pytest.approx(parts.sum(), rel=1e-4)
    monkeypatch.setattr(
        kernels.BandPlan, "wavelengths", lambda plan, centre, *_: np.array([centre])
    )
    kernels.forget()
    assert np.abs(tiles(BAND, reach)[1] - parts).sum() > 8 * left, (
        "one wavelength alone would not do: rings do not wash out"
    )


def test_there_are_as_many_as_the_pattern_moves_by_speckles(used):
    """At 120 um it moves by 120 um x 50 / 550 over the band: five times f-number x wavelength. A
    band of 1 nm needs one.
    """
    tiles(BAND, 120)
    tiles([549.0, 550.0, 551.0], 120)
    assert used == [np.ceil(120 * 50 / w / (4e-3 * w)) for w in BAND] + [1, 1, 1] and used[1] == 5
