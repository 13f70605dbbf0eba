"""Dust with a phase delay: limits, energy, Babinet's closed form, wavelengths, and the remaining
symmetry.
"""

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, WavefrontLens
from isethdr_optics.psf.kernels import KernelRequest, computed, kernels
from isethdr_optics.pupil.pupil_cells import amplitude
from isethdr_optics.pupil.pupil_energy import open_energy_mm2
from isethdr_optics.pupil.pupil_grid import axis_mm
from isethdr_optics.pupil.pupil_phase import has_phase, phase_change

from isethdr_core import compose
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger
from isethdr_core.physics.optics.pupil import disc

LENS = DiffractionLimitedLens(falloff="none")
GLASS = ApertureFlare(
    blades=0, dust_per_mm2=200.0, dust_opacity=(0.0, 0.0), scratches_per_mm2=0.0, dust_delay_um=0.55
)
CLEAN = ApertureFlare(blades=0, dust_per_mm2=0.0, scratches_per_mm2=0.0)


@dataclass(frozen=True)
class OneGrain:
    """One grain with given position, loss and delay."""

    delay_um: float
    loss: float = 0.0
    radius_mm: float = 0.15
    x_mm: float = 0.2

    def pupil_shapes(self, radius_mm):
        return disc(0.0, 0.0, radius_mm), [
            (disc(self.x_mm, 0.0, self.radius_mm), self.loss, self.delay_um)
        ]


def test_no_delay_is_dust_as_it_was():
    plain = ApertureFlare()
    none = ApertureFlare(dust_delay_um=0.0)
    assert all(len(shape) == 2 for shape in none.pupil_shapes(0.5)[1]) and not has_phase(
        LENS, [none]
    )
    axis = axis_mm(LENS, 0.02)
    assert amplitude(LENS, [none], axis, axis, 550.0).dtype == np.float32
    pairs = OneGrain(0.0, 0.4)
    triples = OneGrain(0.0, 0.4)
    object.__setattr__(
        pairs, "pupil_shapes", lambda r: (disc(0, 0, r), [(disc(0.2, 0.0, 0.15), 0.4)])
    )
    np.testing.assert_array_equal(
        LENS.psf([550], 2.0, 32, [pairs]), LENS.psf([550], 2.0, 32, [triples])
    )
    np.testing.assert_array_equal(
        LENS.psf([550], 2.0, 32, [plain]), LENS.psf([550], 2.0, 32, [none])
    )


def test_clear_dust_a_wave_thick_is_not_seen_at_that_wavelength_alone():
    seen, half = LENS.psf([550, 1100], 2.0, 64, [GLASS]).values
    clean, clean_half = LENS.psf([550, 1100], 2.0, 64, [CLEAN]).values
    np.testing.assert_allclose(seen, clean, atol=1e-6 * clean.max())  # float32 transmissions
    assert np.abs(half - clean_half).sum() > 0.05


@pytest.mark.parametrize("turns", [0.1, 0.25, 0.5, 0.8])
def test_babinet_on_the_axis(turns):
    """Compare with Babinet's closed form: clear glass on a share f of the pupil leaves
    |1 + f (exp(i phase) - 1)|^2 of the light on the axis.
    """
    got = float(LENS.psf([550], 1.0, 2, [OneGrain(turns * 0.55)]).values[0, 1, 1])
    share = 0.15**2 / 0.5**2
    want = abs(1 + share * (np.exp(2j * np.pi * turns) - 1)) ** 2 * float(
        LENS.psf([550], 1.0, 2).values[0, 1, 1]
    )
    assert got == pytest.approx(want, rel=1e-5)  # float32 sums over 600 000 cells


def test_delay_takes_no_light_away():
    given = dict(dust_per_mm2=200.0, dust_opacity=(0.2, 0.9))
    energies = [
        open_energy_mm2(LENS, [ApertureFlare(dust_delay_um=d, **given)], 550.0)
        for d in (0.0, 0.2, 3.0)
    ]
    assert energies[0] == energies[1] == energies[2]
    # error of the area of discs, summed by chords
    assert open_energy_mm2(LENS, [GLASS], 450.0) == pytest.approx(np.pi / 4, rel=1e-6)
    # The point spread keeps all light: only the wings of the grains, a few percent, lie outside of
    # these samples.
    assert 0.9 < LENS.psf([500], 2.0, 64, [GLASS]).values.sum() < 1.0


@pytest.mark.slow
def test_amplitudes_are_those_of_the_points():
    # dense enough for grains to overlap
    flare = ApertureFlare(
        dust_per_mm2=300.0, dust_radius_um=20.0, dust_delay_um=0.7, scratches_per_mm2=10.0
    )
    axis = axis_mm(LENS, 0.02)
    cells = amplitude(LENS, [flare], axis, axis, 480.0)
    inner = (np.arange(8) - 3.5) / 8 * 0.02
    points = flare.pupil(
        (axis[:, None] + inner).ravel()[None, :], (axis[:, None] + inner).ravel()[:, None], 480.0
    )
    mean = points.reshape(len(axis), 8, len(axis), 8).mean((1, 3))
    assert cells.dtype == np.complex64 and np.abs(points).max() <= 1 + 1e-12
    # 64 points per cell: in cells with an edge, at most a third of all cells, one point in sixteen
    # falls on the wrong side
    assert np.abs(cells - mean).mean() < 0.02
    assert abs((cells - mean).mean()) < 1e-3


def test_the_mirror_image_is_lost_and_kernels_know():
    """A clear grain off the axis sends more light to one side than to the other.

    The opposite delay makes the mirror image.
    """
    one, other = (LENS.psf([550], 1.5, 65, [OneGrain(d)]).values[0] for d in (0.15, -0.15))
    assert np.abs(one - one[::-1, ::-1]).sum() > 0.02
    # float32 rounding; the stop itself is symmetric
    np.testing.assert_allclose(one, other[::-1, ::-1], atol=1e-6 * one.max())
    [band] = computed(
        KernelRequest(LENS, [OneGrain(0.15)], np.array([550.0]), (3.0, 3.0), (20, 20))
    ).bands
    sharp = LENS.psf([550], 3.0, 41, [OneGrain(0.15)], integrated=True).values[0]
    skew, want = ((b - b[::-1, ::-1])[20, 21:24] for b in (band, sharp))
    assert (np.sign(skew) == np.sign(want)).all() and np.abs(skew).max() > 0.1 * np.abs(want).max()


def test_phase_change_over_a_band_and_bad_input():
    assert phase_change(LENS, [OneGrain(10.0)], 545.0, 555.0) == pytest.approx(
        2 * np.pi * 1e4 * (1 / 545 - 1 / 555)
    )
    assert phase_change(LENS, [CLEAN], 545.0, 555.0) == 0.0
    with pytest.raises(ConfigError, match="dust_delay_um=0"):
        ApertureFlare(dust_delay_um=np.nan)


BANDS = np.arange(400.0, 701.0, 10.0)


def largest_um(wave=400.0, width=10.0):
    """Return the delay, um, with a change of phase of 16 x 0.3 rad within a band."""
    return 4.8 / (2e3 * np.pi * (1 / (wave - width / 2) - 1 / (wave + width / 2)))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_delay_that_bands_cannot_follow_is_refused_before_any_work(monkeypatch, sign):
    allowed, refused = (
        ApertureFlare(dust_delay_um=sign * part * largest_um()) for part in (0.99, 1.01)
    )
    assert allowed.narrow(Demand(wavelength_nm=tuple(BANDS))) == Demand(wavelength_nm=tuple(BANDS))
    with pytest.raises(
        ConfigError, match="band at 400 nm, 10 nm wide.* at most 4.8 rad.*dust_delay_um=12 or less"
    ):
        refused.narrow(Demand(wavelength_nm=tuple(BANDS)))
    for demand in (Demand(), Demand(wavelength_nm=tuple(np.arange(500.0, 701.0, 5.0)))):
        assert refused.narrow(demand) is demand  # bands not known yet, or narrow enough

    class Computed(Exception):
        """Raised instead of the work."""

    def work(*arguments):
        raise Computed

    monkeypatch.setattr("isethdr_optics.psf.kernels.lookup._cache", OrderedDict())
    monkeypatch.setattr("isethdr_optics.psf.kernels.computing.computed", work)
    with pytest.raises(ConfigError, match="narrower bands"):
        kernels(KernelRequest(LENS, [refused], BANDS, (3.0, 3.0), (20, 20)))
    with pytest.raises(Computed):
        kernels(KernelRequest(LENS, [allowed], BANDS, (3.0, 3.0), (20, 20)))


@pytest.mark.slow
def test_the_lens_s_own_phase_counts_too():
    defocus = WavefrontLens(zernike_um={4: 14.0})
    assert phase_change(defocus, (), 395.0, 405.0) > 4.8
    with pytest.raises(ConfigError, match="the lens by"):
        kernels(KernelRequest(defocus, [OneGrain(0.1)], BANDS, (3.0, 3.0), (20, 20)))


def test_a_run_refuses_it_in_the_plan():
    from isethdr_core.pipeline.chain import chain, plan

    given = [
        "scene=macbeth",
        "~renderer",
        "scene.width=16",
        "scene.height=12",
        "scene.step_nm=50",
        "sensor=ideal",
        "isp=ideal",
    ]
    with pytest.raises(ConfigError, match="dust_delay_um is 30.*narrower bands"):
        plan(chain(compose([*given, "flare.dirt.dust_delay_um=30"])), Ledger())
