"""EMVA 1288 for cameras with nonlinear output: companded codes, soft knees, logarithms.

The standard's general model makes no assumption about the response. Mean and temporal noise are
measured level by level from pairs of pictures. The slope of the measured response converts the
noise to the input, without gain and quantum efficiency. The true values are computed without
pictures: the distribution of the charge is known in closed form, and quadrature maps it through the
converter's curve.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import Any

import numpy as np
from isethdr_sensors.charge.soft_knee import HasSoftKnee
from isethdr_sensors.noise.read_noise import TAIL_WIDTH
from isethdr_sensors.readout import converter
from scipy.stats import poisson

from isethdr_core.physics.detector.charge_dynamics_noise import EMPTY, flow_moments

from .camera import Bench, pair
from .estimates import Estimate

STEP = 0.1  # the slope is taken between levels this much above and below, relative
NORMAL_FROM_E = 100.0  # mean charge above which a normal distribution is used
QUADRATURE = np.linspace(-7.0, 7.0, 281)
DENSITY = np.exp(-0.5 * QUADRATURE**2)
DENSITY /= DENSITY.sum()
SHARES = (0.01, 0.1, 0.5, 0.8)  # levels, as shares of the linear full scale
BEYOND = (1.5, 10.0, 100.0, 1e4)  # further levels, which are measured as long as the codes rise


def general_figures(bench: Bench) -> Iterator[tuple[str, str, Estimate, float]]:
    """Yield (figure, unit, estimate, truth) of the bench's capture and channel: mean, temporal
    noise and SNR over its whole range.
    """
    sensor = bench.sensor
    efficiency = bench.efficiency()
    full_scale = sensor.full_scale_e()[bench.capture] / efficiency  # photons
    for share in (0.0, *SHARES, *BEYOND):
        low, middle, high = (
            expected_dn(bench, share * factor * full_scale * efficiency)
            for factor in (1 - STEP, 1, 1 + STEP)
        )
        if share > 1 and not high[0] - low[0] > 0.5:  # the codes do not rise any more
            return
        exposed = pair(bench, share * full_scale)
        label = f"{share:g} of full scale"
        yield (
            f"mean at {label}",
            "DN",
            Estimate(
                exposed.mean_dn, mean_error_dn(bench, exposed, (high[0] - low[0]) / (2 * STEP))
            ),
            middle[0],
        )
        of_variance = sqrt(kurtosis_factor(bench)) * exposed.variance_dn2 / sqrt(exposed.pixels)
        noise = sqrt(exposed.variance_dn2)
        yield (
            f"temporal noise at {label}",
            "DN",
            Estimate(noise, of_variance / (2 * noise)),
            sqrt(middle[1]),
        )
        if share:
            below, above = (
                pair(bench, share * factor * full_scale) for factor in (1 - STEP, 1 + STEP)
            )
            rise = above.mean_dn - below.mean_dn
            rise_error = sqrt((above.variance_dn2 + below.variance_dn2) / 2 / exposed.pixels)
            snr = rise / (2 * STEP * noise)
            error = snr * sqrt((rise_error / rise) ** 2 + (of_variance / (2 * noise**2)) ** 2)
            yield (
                f"SNR at {label}",
                "1",
                Estimate(snr, error),
                (high[0] - low[0]) / (2 * STEP * sqrt(middle[1])),
            )


def expected_dn(bench: Bench, light_e: float) -> tuple[float, float]:
    """Return the true mean, DN, and temporal variance, DN^2, of the output of a pixel without fixed
    pattern.

    Parameters
    ----------
    bench : camera, capture and channel.
    light_e : mean electrons of light.
    """
    model = bench.sensor.model()
    reading = model.readings[bench.capture]
    diode = model.diode_of(reading)
    charge, share = charge_distribution(
        *charge_moments(bench, light_e + diode.dark_e_per_s * model.exposure_of(diode))
    )
    width = sqrt(reading.read_noise_e**2 + reading.row_noise_e**2)
    # charge is clipped at the well before it is read, so the two noises are integrated separately:
    # shot noise along the first axis, read noise along the second
    values = np.minimum(charge, diode.full_well_e)[:, None] + width * QUADRATURE[None, :]
    dn = converter.companded(converter.digitise(values, reading), reading)
    weight = share[:, None] * DENSITY
    mean = float(np.sum(weight * dn))
    return mean, float(np.sum(weight * (dn - mean) ** 2))


def charge_distribution(mean_e: float, variance_e2: float) -> Any:
    """Return charges and their probabilities: a Poisson distribution if the mean is small, else a
    normal distribution.

    Parameters
    ----------
    mean_e : mean charge, electrons.
    variance_e2 : variance of the charge, electrons squared; the Poisson distribution ignores it.
    """
    if mean_e > NORMAL_FROM_E:
        return mean_e + sqrt(variance_e2) * QUADRATURE, DENSITY
    count = np.arange(np.ceil(mean_e + 12 * sqrt(mean_e) + 12))
    return count, poisson.pmf(count, mean_e)


def charge_moments(bench: Bench, arrived_e: float) -> tuple[float, float]:
    """Return mean (e) and variance (e^2) of the charge that a capture reads. They are those of a
    Poisson distribution, or of the charge that a soft knee leaves.

    Parameters
    ----------
    bench : camera, capture and channel.
    arrived_e : mean electrons of light and dark charge that arrive.
    """
    sensor = bench.sensor
    all_read = sensor.model().readings[bench.capture].capture == "LCG"
    if all_read or not isinstance(sensor, HasSoftKnee):
        return arrived_e, arrived_e
    moments = flow_moments(EMPTY, arrived_e / sensor.exposure_s, sensor.exposure_s, sensor.well())
    return float(moments.charge_e), float(moments.charge_var_e2)


def mean_error_dn(bench: Bench, exposed: Any, slope_dn: float) -> float:
    """Return the standard error of a channel's mean, DN. It includes the temporal noise of two
    pictures, and the fixed patterns of the pixels.

    Parameters
    ----------
    bench : camera, capture and channel.
    exposed : the pair of pictures.
    slope_dn : DN per relative change of the light, by which PRNU spreads the response.
    """
    model = bench.sensor.model()
    reading = model.readings[bench.capture]
    diode = model.diode_of(reading)
    gain = reading.gain_dn_per_e
    shared = (
        gain
        * sqrt(reading.column_e**2 + reading.row_e**2 + reading.row_noise_e**2 / 2)
        / sqrt(bench.size)
    )
    dark = gain * diode.dark_e_per_s * model.exposure_of(diode) * diode.dark_spread
    temporal = sqrt(
        exposed.variance_dn2 / 2
        + (slope_dn * diode.prnu) ** 2
        + (gain * reading.dsnu_e) ** 2
        + dark**2
    )
    # hot pixels are defects, which the true mean does not include
    hot = gain * diode.hot_percent / 100 * diode.hot_dark_e_per_s * model.exposure_of(diode)
    return sqrt(temporal**2 / exposed.pixels + shared**2) + hot


def kurtosis_factor(bench: Bench) -> float:
    """Return n times the relative variance of a sample variance of n pixels. It is 2 for normal
    noise, and more if some pixels have wider read noise.
    """
    share = bench.sensor.model().readings[bench.capture].read_tail_percent / 100
    body = 1 / (1 - share + share * TAIL_WIDTH**2)
    return 3 * body**2 * (1 - share + share * TAIL_WIDTH**4) - 1
