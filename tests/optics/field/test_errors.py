"""Stated kernel errors with a field-dependent PSF or lateral colour, against finer kernels."""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, WavefrontLens
from isethdr_optics.field import errors, imaging, kernels_of_field, point_choice
from isethdr_optics.field.field_point_psf import knots
from isethdr_optics.field.lateral_colour import READ, Course
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.psf import exact_core
from isethdr_optics.psf.kernels import core_size, lookup

from isethdr_core.data import quantities

DIRT = (ApertureFlare(),)
VARIES = {"field_zernike_um": {0: {}, 8: {4: 0.08, 12: 0.05}}, "error_allowed": 0.99}
COLOUR = {"zernike_um": {8: 0.05}, "lateral_colour_percent": {500.0: 4.0, 560.0: 0.0, 620.0: -4.0}}


def street(shape=(34, 50), pitch_um=10.0):
    """Return mixed radiance of a dark field with grain and one lamp of 2 x 3 tiles."""
    light = np.random.default_rng(2).uniform(0.5, 1.5, (2, *shape))
    light[:, 8:10, 12:15] = 1e6
    y, x = (quantities.centres(n, n * pitch_um * 1e-3 / 6.0) for n in shape)
    return quantities.plane(
        (1e-6 * light).astype(np.float32), [550.0, 570.0], x, y, quantities.RADIANCE
    )


@pytest.mark.parametrize(
    "fields, core_samples",
    [
        pytest.param(VARIES, 240, marks=pytest.mark.slow),
        pytest.param(VARIES, 120, marks=pytest.mark.slow),
        pytest.param(COLOUR, 240, marks=pytest.mark.slow),
    ],
    ids=["far", "places", "colour"],
)
def test_light_differs_from_that_of_finer_kernels_as_stated(monkeypatch, fields, core_samples):
    """Compare light with that of kernels of a third of the sampling error.

    The cases: errors of the PSF wings alone; errors of field points with a blur wider than their
    exact core; errors moved by lateral colour.
    """
    monkeypatch.setattr(core_size, "CORE_SAMPLES", core_samples)
    # field-point kernels are computed as the kernel on the axis, with errors of their own
    monkeypatch.setattr(knots, "WORTH", 0.0)
    monkeypatch.setattr(point_choice, "RINGS", (1,))
    monkeypatch.setattr(
        imaging, "core_reach", lambda along, waves, pitch_um, shape: ((24, 24), (24, 24))
    )
    monkeypatch.setattr(lookup, "_cache", type(lookup._cache)())
    # the finer kernels use the axis's kernel for the wings too; the next test covers that error
    monkeypatch.setattr(kernels_of_field.FieldKernels, "unlike_far", None)
    lens = WavefrontLens(focal_length_mm=6.0, **fields)
    mixed = street()
    with exact_core.kept_cores():
        deviation, bound, *_ = lens.light_errors(mixed, DIRT, np.eye(2))
        light, finer = (
            one(mixed, DIRT).values
            for one in (lens, replace(lens, speckle_error=lens.speckle_error / 3))
        )
    assert deviation.shape == bound.shape == light.shape and bound.min() >= 0
    # a smaller deviation is near the rounding of float32
    wrong = np.abs(light - finer)
    lit = deviation > 1e-5 * light
    share = (wrong / deviation)[lit]
    # Upper limits: 1 in 100 normal deviates is beyond 2.6, and their root mean square is 1.
    # Lower limit: the stated error is too large, since it assumes that the errors of neighbouring
    # samples and of field points are fully correlated.
    assert lit.mean() > 0.2 and np.quantile((wrong / (deviation + bound))[lit], 0.99) < 2.6
    assert 0.2 < np.sqrt(np.mean(share**2)) < 1.1


@pytest.mark.slow
def test_a_lamp_off_the_axis_differs_from_its_own_kernel_as_stated(monkeypatch):
    """Compare PSF wings taken from the axis with those of the kernel at the lamp's field point."""
    monkeypatch.setattr(point_choice, "RINGS", (1,))
    monkeypatch.setattr(point_choice, "_grid_error", lambda *given: 0.01)
    lens = WavefrontLens(focal_length_mm=6.0, field_zernike_um={0: {}, 3.2: {4: 0.08, 12: 0.05}})
    mixed = street()
    x = float(mixed.x[13])
    y = float(mixed.y[8])
    mixed.values[...] = 0.0  # no light around the lamp: its kernels would differ too
    mixed.values[:, 8, 13] = 1.0
    deviation, bound, *_ = lens.light_errors(mixed, DIRT, np.eye(2))
    own = node_lens(lens, lens.wavefront_at(np.arctan(np.hypot(x, y))), float(np.arctan2(-y, x)))
    wrong = np.abs(lens(mixed, DIRT).values - own(mixed, DIRT).values)
    # beyond every core
    far = np.maximum(np.abs(np.arange(34)[:, None] - 8), np.abs(np.arange(50) - 13)) > 24
    share = wrong[:, far] / deviation[:, far]
    # The lamp lies half way to the border, so the error is below the largest one stated. The errors
    # of a single lamp spread more widely than normal deviates, since its spikes differ.
    assert 0.25 < np.sqrt(np.mean(share**2)) < 1.0 and np.quantile(share, 0.99) < 3.5


def test_bands_whose_images_lie_close_are_taken_together():
    # the corner is 36 tiles from the centre, where half a tile is 1.4 %
    assert errors._grouped([1.0, 1.001, 0.9995, 1.02], (40, 60)) == [
        [0, 1, 2],
        [3],
    ]
    rising = Course(np.linspace(0, 36, READ), 1 + np.linspace(0, 0.03, READ), (1.0, 1.0))
    assert errors._grouped([1.0, rising, rising], (40, 60)) == [[0], [1, 2]]
