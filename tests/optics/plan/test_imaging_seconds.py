"""Estimated run time of a lens: less with kernels in memory, more with a wavefront."""

from __future__ import annotations

import numpy as np
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, IdealLens, WavefrontLens
from isethdr_optics.imaging.sensor_plane import without_geometry
from isethdr_optics.psf import kernel_store, kernels

from isethdr_core.pipeline.memory import Frame

WAVE, DIRT = (450.0, 550.0, 650.0), (ApertureFlare(),)


def frame(rows=60, columns=100):
    return Frame(rows, columns, (7.5e-4, 7.5e-4), WAVE, True)  # 3 um at 4 mm


def test_kernels_at_hand_take_no_time(isethdr_home):
    kernels._cache.clear()
    lens = DiffractionLimitedLens()
    anew, larger = lens.expected_s(frame(), DIRT), lens.expected_s(frame(600, 1000), DIRT)
    plain = without_geometry(lens)  # as an image asks for them
    kernels.kernels(plain, DIRT, WAVE, (3.0, 3.0), (59, 99))
    assert 0 < lens.expected_s(frame(), DIRT) < 0.1 * anew
    assert larger > 1.3 * anew


def test_kernels_on_disk_are_at_hand(isethdr_home):
    lens = WavefrontLens(zernike_um={7: 0.05})
    reach, pitch = (59, 99), (3.0, 3.0)
    anew = lens.expected_s(frame(), DIRT)
    assert anew > DiffractionLimitedLens().expected_s(frame(), DIRT)
    name = kernel_store.name(without_geometry(lens), DIRT, np.array(WAVE), pitch, reach, None)
    ones = np.ones((1, 1), np.float32)
    kernel_store.save(name, (1, 1, 1), "<f4", [ones], lambda: np.ones((1, 1)))
    assert lens.expected_s(frame(), DIRT) < 0.1 * anew


def test_a_lens_without_blur_cannot_tell():
    assert IdealLens().expected_s(frame(), ()) is None
