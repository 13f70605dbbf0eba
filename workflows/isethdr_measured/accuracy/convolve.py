"""Convolution methods for light over many decades, against long double sums."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.fft as sf
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core.physics.convolution import convolve

from ..convolution_methods import DEFAULT, METHODS, direct, frame, prepare

SHAPE = (270, 480)
# relative errors allowed; the last two are 0.1 and 1 standard deviation of the shot noise of
# 25 000 electrons, the first is far below
ALLOWED = (1e-5, 6e-4, 6e-3)
RATIO = 1e8  # lamp over background, as for a headlight next to a dark road


def measured() -> list[Work]:
    """Return one diagram: largest relative error of the sampled pixels of a frame with lamps. The
    kernels are prepared in advance and not timed.
    """
    psf = skirt(SHAPE)
    prepared = prepare(psf, SHAPE)
    image = frame(*SHAPE, RATIO)
    pixels, truth = direct(image, psf, METHODS[DEFAULT](image, prepared))
    methods = METHODS | {
        "float32, circular": circular(psf, np.float32),
        "float64, circular": circular(psf, np.float64),
    }
    methods |= {
        f"float64, {allowed:g} allowed": lambda image, prepared, allowed=allowed: convolve(
            image, prepared["product"], allowed
        )
        for allowed in ALLOWED
    }
    points = []
    for name, method in methods.items():
        result, cpu_s, peak_mb = timed(lambda way=method: way(image, prepared), repeat=3)
        mark = "default" if name == DEFAULT else "peer" if "circular" in name else ""
        points.append(
            Point(
                name,
                float(np.max(np.abs(result[pixels] / truth - 1))),
                cpu_s,
                peak_mb,
                mark,
            )
        )
    return [
        Work(
            "convolution",
            "largest relative error of a pixel, lamps 1e8 times the background",
            "long double sums at sampled pixels",
            1e-15,
            points,
        )
    ]


def skirt(shape: tuple[int, int]) -> np.ndarray:
    """Return a kernel as large as the whole frame that falls with the cube of the distance."""
    y, x = (np.arange(1 - n, n) for n in shape)
    psf = (1 + np.hypot(y[:, None], x)) ** -3.0
    return psf / psf.sum()


def circular(psf: np.ndarray, dtype: Any) -> Callable[..., Any]:
    """Return the common method: the kernel is cut to the frame, and one transform of the frame's
    own size wraps light around the borders.
    """
    ny, nx = SHAPE
    cy, cx = (n // 2 for n in psf.shape)
    cut = psf[cy - ny // 2 : cy - ny // 2 + ny, cx - nx // 2 : cx - nx // 2 + nx].astype(dtype)
    spectrum = sf.rfft2(np.roll(cut / cut.sum(), (-(ny // 2), -(nx // 2)), (0, 1)))
    return lambda image, prepared: sf.irfft2(sf.rfft2(image.astype(dtype)) * spectrum, SHAPE)
