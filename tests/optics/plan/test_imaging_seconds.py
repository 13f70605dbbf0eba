"""Estimated run time of a lens: less with kernels in memory, more with a wavefront."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from isethdr_optics import (
    ApertureFlare,
    DiffractionLimitedLens,
    GhostFlare,
    IdealLens,
    WavefrontLens,
)
from isethdr_optics.flare.ghosts.ghost_flare import (
    SOURCE_S,
    TRACED_S,
    TYPICAL_SOURCES,
)
from isethdr_optics.imaging.sensor_plane import without_geometry
from isethdr_optics.imaging.threads import MOST_THREADS, cpus
from isethdr_optics.lenses.prescription_lens import PrescribedLens
from isethdr_optics.plan import imaging_seconds
from isethdr_optics.psf import kernel_store, kernel_work, kernels
from isethdr_optics.psf.kernels import KernelRequest
from isethdr_optics.psf.kernels.patterns import of_one_pattern, one_pattern_frame

from isethdr_core import quantities
from isethdr_core.physics.optics import ray_sums
from isethdr_core.pipeline.memory import Frame

WAVE = (450.0, 550.0, 650.0)
DIRT = (ApertureFlare(),)
GRAINS = ApertureFlare(dust_delay_um=0.05)  # its phase is not linear in wavenumber


def frame(rows=60, columns=100):
    return Frame(rows, columns, (7.5e-4, 7.5e-4), WAVE, True)  # 3 um at 4 mm


def test_kernels_at_hand_take_no_time(isethdr_home):
    kernels.forget()
    lens = DiffractionLimitedLens()
    anew = lens.expected_s(frame(), DIRT)
    larger = lens.expected_s(frame(600, 1000), DIRT)
    plain = without_geometry(lens)  # images request their kernels with this lens
    kernels.kernels(KernelRequest(plain, DIRT, WAVE, (3.0, 3.0), (59, 99)))
    assert 0 < lens.expected_s(frame(), DIRT) < 0.1 * anew
    assert larger > 1.3 * anew


def test_kernels_on_disk_are_at_hand(isethdr_home):
    lens = WavefrontLens(zernike_um={7: 0.05})
    reach = (59, 99)
    pitch = (3.0, 3.0)
    anew = lens.expected_s(frame(), DIRT)
    assert anew > DiffractionLimitedLens().expected_s(frame(), DIRT)
    name = kernel_store.name(
        KernelRequest(without_geometry(lens), DIRT, np.array(WAVE), pitch, reach)
    )
    ones = np.ones((1, 1), np.float32)
    kernel_store.save(name, (1, 1, 1), "<f4", [ones], lambda: np.ones((1, 1)))
    assert lens.expected_s(frame(), DIRT) < 0.1 * anew


def test_lattices_are_made_again_beside_lamps(isethdr_home):
    """Estimate more time with lamps for kernels from lattices, which are then computed again.

    Kernels from one pattern get a wider exact core instead, which is not part of the estimate.
    """
    kernels.forget()
    lens = DiffractionLimitedLens()
    for flares, most in (((GRAINS,), 3.0), (DIRT, 1.0)):
        dark = lens.expected_s(frame(), flares)
        bright = lens.expected_s(replace(frame(), lamps=True), flares)
        assert max(1.0, 0.8 * most) * dark <= bright <= most * dark
        unsensed = replace(frame(), lamps=True, sensed=False)
        assert lens.expected_s(unsensed, flares) == pytest.approx(dark)


def test_a_lens_without_blur_cannot_tell():
    assert IdealLens().expected_s(frame(), ()) is None


def test_kernels_of_another_reach_are_at_hand_only_where_sensors_may_end_them(isethdr_home):
    """A sensor's response may allow kernels that are smaller than the frame, never larger ones."""
    kernels.forget()
    lens = DiffractionLimitedLens()
    plain = without_geometry(lens)
    kernels.kernels(KernelRequest(plain, DIRT, WAVE, (3.0, 3.0), (59, 99)))
    given = plain, DIRT, WAVE, (3.0, 3.0)
    assert kernels.at_hand(KernelRequest(*given, (59, 99)))
    assert not kernels.at_hand(KernelRequest(*given, (29, 49))) and not kernels.at_hand(
        KernelRequest(*given, (299, 499))
    )
    assert kernels.at_hand(KernelRequest(*given, (299, 499)), 0.5)
    assert not kernels.at_hand(KernelRequest(*given, (89, 149)), 0.5)
    smaller = lens.expected_s(frame(30, 50), DIRT)
    same = lens.expected_s(frame(), DIRT)
    assert smaller > 10 * same


def test_ghosts_are_part_of_the_runtime_estimate(monkeypatch):
    monkeypatch.setattr(imaging_seconds, "relative_speed", lambda: 1.0)  # as the constants are
    lens = DiffractionLimitedLens()
    ghosts = GhostFlare()
    pairs, _ = ghosts.pairs(lens, np.array(WAVE), 0.05)
    more = lens.expected_s(frame(), (*DIRT, ghosts)) - lens.expected_s(frame(), DIRT)
    expected = len(pairs) * (TRACED_S + SOURCE_S * TYPICAL_SOURCES * len(WAVE))
    # the number of pairs depends a little on the field; two cores share the work
    assert 0.3 * expected < more < 1.5 * expected


def test_more_work_takes_longer():
    """Estimate more time for more bands, a wavefront, a faster lens or dust with a delay."""

    def said(lens, wave=WAVE, flares=DIRT, reach=(179, 319)):
        return kernels.expected_s(KernelRequest(lens, flares, np.array(wave), (3.0, 3.0), reach))

    usual = said(DiffractionLimitedLens())
    assert said(DiffractionLimitedLens(), np.linspace(400, 700, 31)) > 1.1 * usual
    assert said(DiffractionLimitedLens(f_number=2.0)) > 1.5 * usual
    assert said(WavefrontLens(zernike_um={7: 0.05})) > 2 * usual
    assert said(WavefrontLens(zernike_um={7: 0.05}), flares=(GRAINS,)) > usual  # from lattices
    assert said(DiffractionLimitedLens(), reach=(9, 9)) < usual


@pytest.mark.slow
def test_the_work_of_rings_is_what_is_done(monkeypatch):
    """Compare the estimated number of running sums, and of reads at band borders, with those done.

    The estimate is made without samples.
    """
    done = [0, 0]
    sums = ray_sums._running_sums
    changes = ray_sums._Reader._changes

    def counted_sums(sector, rays, apply):
        made = sums(sector, rays, apply)
        done[0] += made.size
        return made

    def counted_changes(self, x, cut, weight):
        done[1] += cut.stop - cut.start
        return changes(self, x, cut, weight)

    monkeypatch.setattr(ray_sums, "_running_sums", counted_sums)
    monkeypatch.setattr(ray_sums._Reader, "_changes", counted_changes)
    lens = DiffractionLimitedLens(focal_length_mm=6.0)
    wave = np.array(WAVE)
    frame_of = one_pattern_frame(KernelRequest(lens, DIRT, wave, (3.0, 3.0), (90, 120)))
    of_one_pattern(frame_of)
    counts = kernel_work.one_pattern(frame_of)
    borders = len(np.unique(frame_of.edges_nm))
    assert counts.sums == pytest.approx(done[0], rel=0.02)
    assert counts.reads == pytest.approx(done[1] * borders * len(wave), rel=0.1)


COMA = {0: {}, 25: {8: 0.12, 5: 0.08}}


def test_a_lens_that_varies_over_the_field_takes_longer(isethdr_home):
    """Kernels of field points take time in addition to those on the axis.

    A wavefront that varies more over the field needs more field points.
    """
    kernels.forget()
    wide = Frame(24, 40, (6e-3, 6e-3), WAVE, True)
    axis = WavefrontLens(zernike_um={}).expected_s(wide, ())
    even, uneven = (
        WavefrontLens(field_zernike_um={0: {}, 25: {8: um}}).expected_s(wide, ())
        for um in (0.005, 0.2)
    )
    assert axis < even < uneven


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lens", "rows", "columns", "pitch", "bands"),
    [
        (WavefrontLens(f_number=3.0, focal_length_mm=5.0, field_zernike_um=COMA), 40, 64, 5e-3, 8),
        (
            PrescribedLens(prescription="cooke_triplet", f_number=6.0, focal_length_mm=5.0),
            40,
            64,
            3e-3,
            4,
        ),
    ],
)
def test_what_a_varying_lens_takes_is_expected(isethdr_home, lens, rows, columns, pitch, bands):
    """Compare the estimate with CPU seconds for frames, lenses and bands outside of its fit.

    A factor of two: CPU seconds of a busy machine vary by half, and a frame unlike those of the fit
    errs by as much again.
    """
    kernels.forget()
    wave = np.linspace(420.0, 680.0, bands)
    x, y = (quantities.centres(n, n * pitch) for n in (columns, rows))
    size = {"field_width": columns * pitch, "field_height": rows * pitch}
    values = np.ones((bands, rows, columns), np.float32)
    mixed = quantities.plane(values, wave, x, y, quantities.RADIANCE, **size)
    frame = Frame(rows, columns, (pitch, pitch), tuple(wave), False)
    threads = min(cpus(), MOST_THREADS)
    said_s = lens.expected_s(frame, ()) * threads**0.5  # CPU seconds
    start = process_time()
    lens(mixed)
    taken_s = process_time() - start
    assert 0.5 < said_s / taken_s < 2.0
