"""Phase that changes within a part of a band: the stated error against more parts, refusal of
phases that are too large, and no statement for small ones.
"""

import numpy as np
import pytest
from isethdr_optics import WavefrontLens
from isethdr_optics.psf import band_phase, kernels, wings
from isethdr_optics.psf.kernels import BandPlan, KernelRequest, core_size
from isethdr_optics.psf.wings import band_parts, band_rings
from isethdr_optics.pupil import pupil_energy, pupil_phase

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.uncertainty import ledger

# its phase changes by 7.0 rad rms over 100 nm about 450 nm, which needs 24 parts
COMA = WavefrontLens(zernike_um={8: 2.0, 4: 1.0})
WAVE = 450.0
WIDTH = 100.0


def stated(lens, waves):
    return [(e.value, e.label) for e in band_phase.errors((lens,), np.asarray(waves))]


@pytest.mark.slow
def test_too_few_parts_are_as_wrong_as_stated(monkeypatch):
    monkeypatch.setattr(core_size, "CORE_SAMPLES", 30)
    lens = WavefrontLens(zernike_um={8: 0.3, 4: 0.15})
    reach = (12, 12)
    change = pupil_phase.phase_change(lens, (), WAVE - WIDTH / 2, WAVE + WIDTH / 2)
    plan = BandPlan(lens, (), (WAVE, WIDTH), wings.Grid(1, (3.0, 3.0), reach))
    energy = pupil_energy.open_energy_mm2(lens, (), WAVE)

    def ring(parts):
        monkeypatch.setattr(band_rings, "parts_of", lambda *given: parts)
        return wings.ring(plan, reach, WAVE, WIDTH, energy)

    true, wrong = ring(4)
    seen = wrong != 0
    for module in (band_parts, wings):
        monkeypatch.setattr(module, "MOST_PARTS", 1)
    [(error, what)] = stated(lens, [WAVE, WAVE + WIDTH])
    few = ring(1)[0]
    found = np.abs(few - true)[seen].sum() / true[seen].sum()
    assert error == pytest.approx(band_phase.STANDING * change**2) and "made of 1" in what
    # tiles of 3 um average several speckles each; the stated error is the largest for any pupil and
    # tile, that of speckles with full contrast
    assert error / 20 < found < error


def test_what_parts_follow_is_not_stated_and_what_no_parts_follow_is_refused():
    narrow = np.arange(400.0, 701.0, 10.0)
    wide = np.array([450.0, 550.0])
    assert not stated(COMA, narrow) and not band_phase.check(COMA, (), narrow)
    [(error, what)] = stated(COMA, wide)
    assert 0 < error < 0.1 and "24 parts of the band at 450 nm" in what
    strong = WavefrontLens(zernike_um={8: 20.0})
    with pytest.raises(
        ConfigError, match=r"450 nm, 100 nm wide.*use bands of (\d+) nm or less"
    ) as refused:
        kernels.kernels(KernelRequest(strong, (), wide, (3.0, 3.0), (8, 8)))
    narrower = float(str(refused.value).split("use bands of ")[1].split(" nm")[0])
    assert 50 < narrower < 100
    # the band width that the message proposes is accepted
    band_phase.check(strong, (), np.array([450.0, 450.0 + narrower]))


@pytest.mark.slow
def test_a_lens_states_it_in_its_ledger(monkeypatch):
    for module in (band_parts, wings):
        monkeypatch.setattr(module, "MOST_PARTS", 1)
    x = quantities.centres(4, 0.01)
    y = quantities.centres(3, 0.008)
    scene = quantities.plane(
        np.ones((2, 3, 4), np.float32), [450.0, 490.0], x, y, quantities.RADIANCE
    )
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        WavefrontLens(zernike_um={8: 0.3})(scene)
    assert any("speckle that 2 parts" in e.label for e in rows[0].errors)
