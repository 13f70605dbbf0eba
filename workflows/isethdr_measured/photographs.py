"""Differences between rendered streets and photographs: the histogram of log luminance, the slope
of the amplitude spectrum, and the differences of neighbouring tiles.

The statistics are those of the literature on natural images. They are computed from the luminance
of rendered radiance, before any lens or camera.

References
----------
Tolhurst, Tadmor and Chao 1992 (Ophthalmic Physiol. Opt. 12, 229-232), abstract: amplitude spectra
of 135 photographs of natural scenes fall with slopes of -0.8 to -1.5 on log-log axes, -1.2 on
average.
Srivastava, Lee, Simoncelli and Zhu 2003 (J. Math. Imaging Vis. 18, 17-33), abstract: statistics of
natural images have high kurtosis, heavy tails and a sharp cusp in the middle.
Grimaldi, Kane and Bertalmio 2019 (J. Vis. 19(2):13), abstract: the power law of the spectrum breaks
down for pictures of a very high dynamic range.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

import isethdr_core as hdr
from isethdr_core.physics.photometry import luminance
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.rendering import render

Array = npt.NDArray[np.float64]
SLOPES = (-1.5, -0.8)  # range of slopes of single photographs, Tolhurst et al. 1992
NORMAL_KURTOSIS = 3.0  # kurtosis of a normal distribution; that of photographs is higher
LOWEST_CYCLES = 3.0  # cycles per height of the picture; below, the window changes the spectrum
HIGHEST_CYCLES = 0.4  # cycles per tile; above, corners and aliasing change the spectrum
RINGS = 12  # number of rings of frequency, of equal width in log frequency


class Statistics(NamedTuple):
    """Statistics of one picture."""

    spread_decades: float  # standard deviation of log10 luminance
    skew: float  # skewness of log luminance
    slope: float  # slope of the amplitude spectrum of luminance on log-log axes
    log_slope: float  # the same slope for log luminance
    # kurtosis of differences of log luminance between neighbours along x; 3 if normal
    kurtosis: float


def photographs(
    roads: str = "city_2_lanes,village,country_curve",
    lightings: str = "day,dusk,night_city",
    width: int = 192,
    samples: int = 32,
    seed: int = 1,
) -> list[dict[str, Any]]:
    """Return a row for each road under each lighting.

    Parameters
    ----------
    roads : kinds of road, separated by commas; each is rendered once, with all light groups.
    lightings : configs of lighting, separated by commas.
    width : tiles across; the height is 9/16 of it.
    samples : paths per tile and light group.
    seed : seed of the streets.

    Returns
    -------
    rows with road, lighting and the fields of `Statistics`; `slope_seen` and `kurtosis_seen` say
    whether the slope and the kurtosis occur in photographs according to the literature above.
    """
    rows = []
    for road in roads.split(","):
        for lighting in lightings.split(","):
            found = statistics(street_luminance(road, lighting, (width, samples, seed)))
            rows.append(
                {
                    "road": road,
                    "lighting": lighting,
                    **found._asdict(),
                    "slope_seen": SLOPES[0] <= found.slope <= SLOPES[1],
                    "kurtosis_seen": found.kurtosis > NORMAL_KURTOSIS,
                }
            )
    return rows


def street_luminance(road: str, lighting: str, effort: tuple[int, int, int]) -> Array:
    """Return the luminance of a street (y, x), cd/m2; the radiance is rendered once and stored.

    Parameters
    ----------
    road : kind of road.
    lighting : config of lighting.
    effort : tiles across, paths per tile and light group, seed of the street.
    """
    width, samples, seed = effort
    config = hdr.compose(
        [
            "scene=street",
            f"scene.road={road}",
            f"scene.seed={seed}",
            f"lighting={lighting}",
            f"renderer.width={width}",
            f"renderer.height={round(width * 9 / 16)}",
            f"renderer.samples={samples}",
            "renderer.margin=0",
        ]
    )
    mixed = chain(config).lighting(render(config).open())
    if "component" in mixed.dims:
        mixed = mixed.sum("component")
    return luminance(mixed.values.astype(float), mixed["wavelength"].values)


def statistics(picture: Array) -> Statistics:
    """Return the statistics of a luminance map.

    Parameters
    ----------
    picture : (y, x) luminance, cd/m2; tiles without light take the least luminance above zero.
    """
    log = np.log(np.maximum(picture, picture[picture > 0].min()))
    return Statistics(
        float(log.std() / np.log(10)),
        float(stats.skew(log, axis=None)),
        amplitude_slope(picture),
        amplitude_slope(log),
        float(stats.kurtosis(np.diff(log, axis=1), axis=None, fisher=False)),
    )


def amplitude_slope(picture: Array) -> float:
    """Return the slope of the amplitude spectrum over frequency on log-log axes.

    The amplitude is the mean over all orientations in rings of equal width in log frequency. A line
    is fitted to the rings by least squares. A Hann window avoids the jump at the borders.

    Parameters
    ----------
    picture : (y, x) any quantity.
    """
    height, width = picture.shape
    window = np.hanning(height)[:, None] * np.hanning(width)
    weighted = (picture - (picture * window).sum() / window.sum()) * window
    amplitude = np.abs(np.fft.rfft2(weighted))
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width))
    edges = np.geomspace(LOWEST_CYCLES / height, HIGHEST_CYCLES, RINGS + 1)
    middles = []
    means = []
    for low, high in zip(edges, edges[1:]):
        ring = (frequency >= low) & (frequency < high)
        if ring.any():
            middles.append(np.log(frequency[ring]).mean())
            means.append(np.log(amplitude[ring].mean()))
    return float(np.polyfit(middles, means, 1)[0])
