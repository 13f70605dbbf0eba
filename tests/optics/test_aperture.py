"""Aperture flare: convergence in the pupil grid, spikes per blade, parallel scratches, presets,
densities.
"""

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens
from isethdr_optics.pupil.pupil_cells import amplitude
from isethdr_optics.pupil.pupil_energy import open_energy_mm2
from isethdr_optics.pupil.pupil_grid import axis_mm
from isethdr_optics.pupil.pupil_size import distance_mm

from isethdr_core.errors import ConfigError
from isethdr_core.physics.diffraction import psf_from_pupil

LENS = DiffractionLimitedLens(falloff="none")
CLEAN = {"dust_per_mm2": 0.0, "scratches_per_mm2": 0.0}
WIPER = dict(
    blades=0,
    dust_per_mm2=0.0,
    scratches_per_mm2=40.0,
    scratch_width_um=3.0,
    scratch_length_um=1500.0,
    scratches_together=8,
    scratch_spacing_um=25.0,
    scratch_direction_deg=90.0,
    scratch_range_deg=0.0,
)


def pattern(flare, samples, size=129):
    """Return a point spread function with samples of 1 um, from `samples` pupil cells per mm."""
    pitch = 1.0 / samples
    axis = axis_mm(LENS, pitch)
    cells = amplitude(LENS, [flare], axis, axis, 550.0)
    return psf_from_pupil(
        cells,
        None,
        550.0,
        pitch,
        distance_mm(LENS),
        1.0,
        size,
        open_energy_mm2(LENS, [flare], 550.0),
        cell_means=True,
        integrated=False,
    )


@pytest.mark.parametrize("flare", [ApertureFlare(), ApertureFlare(**WIPER)])
def test_halving_the_grid_spacing_converges(flare):
    fine = pattern(flare, 1536)
    errors = [np.abs(pattern(flare, n) - fine).sum() / fine.sum() for n in (192, 384, 768)]
    # at least first order, since edges cross cells
    assert errors[0] > 1.7 * errors[1] > 1.7**2 * errors[2]
    assert errors[2] < 2e-3


@pytest.mark.parametrize("blades", [4, 5, 6, 8])
def test_spikes_per_blade(blades):
    """Each blade makes spikes in two opposite directions.

    An even number of blades makes as many spikes, since spikes of opposite blades coincide. An odd
    number makes twice as many.
    """
    psf = LENS.psf(
        [550], 1.0, 301, [ApertureFlare(blades=blades, rotation_deg=7.0, **CLEAN)]
    ).values[0]
    y, x = np.indices(psf.shape) - 150
    ring = (np.hypot(x, y) > 70) & (np.hypot(x, y) < 145)
    angle = np.arctan2(y, x)[ring]
    spikes = blades if blades % 2 == 0 else 2 * blades
    harmonic = {k: abs(np.sum(psf[ring] * np.exp(1j * k * angle))) for k in range(1, 25)}
    assert max(harmonic, key=harmonic.get) % spikes == 0
    phase = np.angle(np.sum(psf[ring] * np.exp(1j * spikes * angle))) / spikes
    # Spikes are perpendicular to the edges, half the angle between two corners from the corner at 7
    # degrees.
    want = np.radians(7.0 + 180.0 / blades)
    assert (
        np.degrees(abs((phase - want + np.pi / spikes) % (2 * np.pi / spikes) - np.pi / spikes))
        < 1.0
    )


def test_rounding_takes_spikes_away():
    def contrast(rounding):
        psf = LENS.psf(
            [550], 1.0, 201, [ApertureFlare(blades=6, rounding=rounding, **CLEAN)]
        ).values[0]
        y, x = np.indices(psf.shape) - 100
        ring = (np.hypot(x, y) > 50) & (np.hypot(x, y) < 95)
        return abs(np.sum(psf[ring] * np.exp(6j * np.arctan2(y, x)[ring]))) / psf[ring].sum()

    sharp, half, circle = (contrast(r) for r in (0.0, 0.7, 1.0))
    assert sharp > half > 10 * circle


def test_parallel_scratches_make_one_streak():
    # scratches along y: the streak lies along x
    psf = LENS.psf([550], 1.0, 201, [ApertureFlare(**WIPER)]).values[0]
    along = psf[95:106, 130:].sum()
    across = psf[130:, 95:106].sum()
    assert along > 10 * across
    turned = LENS.psf(
        [550], 1.0, 201, [ApertureFlare(**{**WIPER, "scratch_direction_deg": 0.0})]
    ).values[0]
    assert turned[130:, 95:106].sum() > 10 * turned[95:106, 130:].sum()


@pytest.mark.slow
def test_densities_are_per_area():
    counts = [
        len(
            ApertureFlare(
                dust_per_mm2=40.0, scratches_per_mm2=24.0, scratches_together=4, seed=s
            ).pupil_shapes(1.0)[1]
        )
        for s in range(200)
    ]
    # 4 mm2: Poisson of mean 160 grains and 24 groups of 4; the mean of 200 seeds within 4 standard
    # errors.
    assert np.mean(counts) == pytest.approx(160 + 96, abs=4 * np.sqrt((160 + 24 * 16) / 200))


def test_dirt_is_all_of_one_loss_where_asked():
    shapes = ApertureFlare(
        dust_opacity=(0.7, 0.7), dust_spread=0.0, scratches_per_mm2=0.0
    ).pupil_shapes(0.5)[1]
    assert {loss for _, loss in shapes} == {0.7}
    assert np.ptp([s.discs[0][2] for s, _ in shapes]) == 0.0 and shapes[0][0].discs[0][
        2
    ] == pytest.approx(9e-3)


@pytest.mark.slow  # the test of all components checks the flare with default fields
@pytest.mark.parametrize("preset", ["clean", "dusty", "wiper", "water", "fingerprint"])
def test_presets(preset):
    from importlib.resources import files

    import yaml

    from isethdr_core.testing import check

    given = yaml.safe_load(
        files("isethdr_optics.conf").joinpath("flare", f"aperture_{preset}.yaml").read_text()
    )
    given.pop("defaults")
    check("flare", "aperture", **given)
    assert 0.3 < open_energy_mm2(LENS, [ApertureFlare(**given)], 550.0) / (np.pi / 4) < 1.0


@pytest.mark.parametrize(
    "bad",
    [
        {"dust_opacity": (0.5, 1.2)},
        {"scratch_opacity": (0.6, 0.4)},
        {"dust_per_mm2": -1.0},
        {"scratches_together": 0},
        {"rounding": 2.0},
    ],
)
def test_mistakes_are_told(bad):
    with pytest.raises(ConfigError, match=f"type .*{next(iter(bad))}="):
        ApertureFlare(**bad)
