"""Field-point kernels: linear interpolation between wavelengths against exact kernels, cases
without interpolation, and thinned grids of field points.
"""

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, PrescribedLens, WavefrontLens
from isethdr_optics.field import field_point_psf
from isethdr_optics.field import grid as field_grid
from isethdr_optics.field.field_point_psf import (
    interpolated_kernels,
    pattern_samples,
    tile_integrals,
)
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.psf.kernels import KernelRequest, computed

from isethdr_core.quantities import centres
from isethdr_core.uncertainty import ledger

DIRT = (ApertureFlare(),)
BANDS = np.arange(400.0, 701.0, 10.0)


def place(name, f_number, degrees, azimuth_rad=0.5, **more):
    lens = PrescribedLens(prescription=name, f_number=f_number, **more)
    angle = np.radians(degrees)
    return node_lens(lens, lens.wavefront_at(angle), azimuth_rad, angle)


def stated(lens, half, flares=DIRT, waves=BANDS):
    return [e.value for e in field_point_psf.errors([lens], flares, waves, half)]


@pytest.mark.parametrize(
    "lens, pitch_um, half",
    [
        # the rims of its surfaces block half of its stop
        pytest.param(place("double_gauss", 4.0, 22.0), 5.2, 12, marks=pytest.mark.slow),
        pytest.param(
            place("double_gauss", 3.2, 10.0, focal_length_mm=6.0), 3.0, 12, marks=pytest.mark.slow
        ),
        # apodized: the light varies over its stop
        pytest.param(place("cooke_triplet", 5.6, 18.0), 2.0, 12, marks=pytest.mark.slow),
        (place("singlet", 8.0, 10.0), 40.0, 3),  # tiles far wider than the point spread
    ],
)
def test_kernels_between_interpolation_wavelengths_are_the_exact_ones_to_what_is_stated(
    lens, pitch_um, half
):
    found = field_point_psf.field_point_kernels(
        KernelRequest(lens, DIRT, BANDS, (pitch_um,) * 2, (half, half))
    )
    [error] = stated(lens, (half, half))
    assert 0.006 < error < 0.032  # neighbours are at most half a radian apart
    worst = []
    for k in (0, 4, 14):  # 400 nm is an interpolation wavelength, 440 lies half way between two
        exact = computed(KernelRequest(lens, DIRT, BANDS[k : k + 2], (pitch_um,) * 2, (half, half)))
        worst.append(np.abs(found.bands[k] - exact.bands[0].astype(float)).sum())
        assert found.transmitted[k] == pytest.approx(exact.transmitted[0], rel=1e-6)
        assert found.outside[k] == pytest.approx(exact.outside[0], abs=1e-3)
    assert 1e-5 < max(worst) < error
    assert min(b.min() for b in found.bands) >= 0


def test_every_transform_is_counted_once(monkeypatch):
    # the distance of knots changes at 460 nm, where two patterns of different extent are needed
    lens = node_lens(WavefrontLens(zernike_um={8: 0.1}), {8: 0.1}, 0.0)
    waves = np.arange(400.0, 701.0, 30.0)
    taken = []

    def counted(*arguments):
        taken.append(arguments[2])
        return pattern_samples.pattern(*arguments)

    monkeypatch.setattr(interpolated_kernels, "pattern", counted)
    field_point_psf.field_point_kernels(KernelRequest(lens, (), waves, (4.0, 4.0), (2, 2)))
    assert sum(nm == 460.0 for nm, _ in taken) == 2
    assert field_point_psf.transforms(lens, (), waves, (2, 2)) == len(taken)


def test_few_bands_are_made_exactly():
    lens = place("double_gauss", 4.0, 8.0)
    for waves in ([550.0], [450.0, 451.0]):
        found, exact = (
            way(KernelRequest(lens, (), waves, (5.0, 5.0), (6, 6)))
            for way in (field_point_psf.field_point_kernels, computed)
        )
        np.testing.assert_array_equal(found.bands[0], exact.bands[0])
        assert not stated(lens, (6, 6), (), waves)


def test_a_band_is_the_mean_of_the_lines_that_it_holds():
    lens = node_lens(WavefrontLens(zernike_um={4: 0.05, 8: 0.08}), {4: 0.05, 8: 0.08}, 0.0)
    lines_nm = 487.5 + 1.25 * (np.arange(20) + 0.5)
    wide, lines = (
        field_point_psf.field_point_kernels(KernelRequest(lens, (), waves, (3.0, 3.0), (8, 8)))
        for waves in (np.array([475.0, 500.0, 525.0]), lines_nm)
    )
    # midpoint sums of two wavelengths per band misplace 1.6e-4 of a point's light; sums of 20
    # misplace 1e-2 of that
    assert np.abs(wide.bands[1] - np.mean(lines.bands, axis=0)).sum() < 1e-5


def test_the_worst_place_is_stated_whichever_comes_last():
    still = WavefrontLens(zernike_um={4: 0.0})
    moving = WavefrontLens(zernike_um={4: 0.3})
    both = []
    for order in ([still, moving], [moving, still]):
        lenses = [node_lens(one, {}, 0.0) for one in order]
        both.append([e.value for e in field_point_psf.errors(lenses, (), BANDS, (6, 6))])
    assert both[0] == both[1] and both[0][0] > 0.006


def test_a_ramp_over_keys_cubic_is_a_ramp_but_near_its_kink():
    """Compare the convolution of a ramp and Keys' cubic with sums over fine steps."""
    at = np.linspace(-2.5, 2.5, 11)
    t = np.arange(-2, 2, 1e-4) + 5e-5
    near, far = (
        np.polynomial.polynomial.polyval(np.abs(t), c)
        for c in ([1, 0, -2.5, 1.5], [2, -4, 2.5, -0.5])
    )
    cubic = np.where(np.abs(t) < 1, near, far)
    want = [(np.maximum(a - t, 0) * cubic).sum() * 1e-4 for a in at]
    np.testing.assert_allclose(tile_integrals.ramp(at), want, atol=1e-7)


def test_the_weights_of_all_tiles_sum_to_one_at_every_point():
    """The weights are a partition of unity, so light is conserved at any scale."""
    for wide in (5.0, 6.37, 31.4):
        size = 2 * int(6 * wide) + 1
        total = tile_integrals.triangles(7, wide, 1.0, size).sum(axis=0)
        np.testing.assert_allclose(total, 1.0, atol=1e-6)


def test_a_thinned_grid_is_a_partition_of_unity_where_it_has_places():
    """Keep rings only in the outer half of the field, the only part where the PSF changes.

    Only the outermost ring needs more azimuths, since only there the PSF changes with azimuth.
    """

    def between(inner, outer):
        return max(outer - max(inner, 0.5), 0.0)

    grid = field_grid.thinned(
        8, 1.0, False, between, lambda r, turn: 0.0 if r < 0.9 else turn, 0.25
    )
    radii = sorted({p.radius for p, _ in grid})
    np.testing.assert_allclose(radii, [0.0, 0.5, 0.75, 1.0])
    counts = {p.radius: p.count for p, _ in grid}
    assert counts[0.5] == field_grid.AROUND and counts[0.0] == 1
    assert counts[1.0] == 32 == min(n for n in range(8, 65, 8) if 2 * np.pi / n <= 0.25)
    x = centres(40, 1.4)
    y = centres(40, 1.4)
    shares = [field_grid.weight(p, step, x, y) for p, step in grid]
    assert min(s.min() for s in shares) >= 0
    np.testing.assert_allclose(sum(shares), 1.0, atol=1e-12)
    everywhere = field_grid.thinned(4, 1.0, False, lambda a, b: 1.0, lambda r, turn: 1.0, 0.5)
    assert [p for p, _ in everywhere] == field_grid.places(4, 1.0, False)


@pytest.mark.slow
def test_a_lens_that_changes_at_the_border_has_its_places_there():
    from isethdr_core.data import quantities

    lens = WavefrontLens(
        field_zernike_um={0: {}, 3: {}, 6.5: {8: 0.12}}, falloff="none", error_allowed=0.1
    )
    values = np.zeros((1, 48, 64), np.float32)
    values[:, 20, 60] = 1.0
    x, y = (quantities.centres(n, n * 0.0028) for n in (64, 48))
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        light = lens(quantities.plane(values, [550.0], x, y, quantities.RADIANCE))
    [note] = [e for e in rows[0].errors if e.source.key == "field places"]
    assert 0 < note.value <= 0.1
    angle = float(np.arctan(np.hypot(x[60], y[20])))
    turn = float(np.arctan2(-y[20], x[60]))
    own = node_lens(lens, lens.wavefront_at(angle), turn)(
        quantities.plane(values, [550.0], x, y, quantities.RADIANCE)
    )
    # half way between two rings and between two azimuths: both errors add
    assert np.abs(light.values - own.values).sum() < 2 * note.value * own.values.sum()
