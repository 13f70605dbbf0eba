"""A flare of a third-party package that declares its own light part: its error reaches the
electrons of that part only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data import quantities
from isethdr_core.uncertainty import ledger, propagation
from isethdr_core.uncertainty.error_terms import Quantity, Source
from isethdr_core.uncertainty.propagation import AFTER_RENDERER, UNIT

PART = "milky light"  # a name that neither the core nor the lens knows
SHARE = 0.2  # light that the flare adds, as a share of the mean light
WRONG = 0.3  # relative error of the added light


@dataclass(frozen=True)
class AcmeVeil:
    """A uniform veil over the lower half of the frame, known to 30 %."""

    share: float = SHARE
    wrong: float = WRONG

    def irradiance(self, lens, mixed):
        """Return the light that the veil adds, on the tiles of `mixed` as `lens` images them."""
        f_m = 1e-3 * lens.focal_length_mm
        values = np.zeros(mixed.shape, np.float32)
        lower = mixed.sizes["y"] // 2
        values[:, lower:] = self.share * lens.throughput_sr() * float(mixed.mean())
        x, y = (mixed[d].values * f_m for d in ("x", "y"))
        added = quantities.plane(values, mixed.wavelength.values, x, y, quantities.IRRADIANCE)
        ledger.light_part(PART, added)
        ledger.error(self.wrong, "relative", "bound", "the veil", key="veil", part=PART)
        return added


def scene():
    x, y = (quantities.centres(n, n * 1e-3) for n in (32, 24))
    light = np.full((2, 24, 32), 1e-2, np.float32)
    return quantities.plane(light, [500.0, 600.0], x, y, quantities.RADIANCE)


def shots_of(flares):
    """Return (electrons of the capture, ledger) of a lens that blurs nothing."""
    mixed = scene()
    lens = hdr.build("lens", "ideal", falloff="none")
    with ledger.stage(rows := ledger.Ledger(), "lens ideal"):
        light = lens(mixed, flares)
    sensor = hdr.build("sensor", "bayer", pitch_um=4.0, exposure_s=0.004)
    captures = sensor(light, hdr.generator(seed=0))
    shots = propagation.electrons(propagation.Exposure(captures, light, mixed, mixed))
    return propagation.with_parts(shots, captures, rows), rows


def test_its_error_reaches_the_electrons_of_its_own_light():
    [shot], rows = shots_of([AcmeVeil()])
    [without], _ = shots_of([])
    added = shot.total - without.total
    half = added.shape[0] // 2
    assert added[half:].min() > 0 and np.all(added[:half] == 0)
    np.testing.assert_allclose(shot.parts[PART], added, atol=1e-5 * shot.total.max())  # float32
    [term] = [t for t in rows[0].errors if t.part == PART]
    assert term.source == Source("lens", "ideal", "veil") and term.acts_on == Quantity.IRRADIANCE
    bound, deviation = propagation.after(shot, [term])
    np.testing.assert_array_equal(bound, WRONG * shot.parts[PART])
    assert not deviation.any()


def test_it_is_the_figure_of_the_picture_and_its_cause():
    [shot], rows = shots_of([AcmeVeil()])
    [without], plain = shots_of([])

    def stated(one, its_rows):
        with ledger.stage(ledger.Ledger(), "picture bayer") as row:
            propagation.record_figures([one], its_rows, 0.1, propagation.Seconds(0.0, 0.0))
        [figure] = [t.value for t in row.errors if t.source.key == AFTER_RENDERER]
        assert row.errors[0].unit == UNIT
        return figure, row.errors[0].label

    figure, label = stated(shot, rows)
    # 99 % of the pixels have at most this error: that of the veil in the half that it covers; 1e-3
    # is for the rounding of the lens
    most = np.quantile(WRONG * shot.parts[PART] / shot.sigma, propagation.SHARE)
    assert figure == pytest.approx(most, rel=1e-3) and label.count("by: the veil") == 1
    assert stated(without, plain)[0] < 1e-3 * figure


def test_two_of_it_add_up():
    [one], _ = shots_of([AcmeVeil()])
    [two], rows = shots_of([AcmeVeil(), AcmeVeil()])
    np.testing.assert_allclose(two.parts[PART], 2 * one.parts[PART], rtol=1e-6)  # float32
    kept, _ = propagation.terms_after(rows)
    assert [term.value for term in kept if term.part == PART] == [WRONG]  # one term for both
