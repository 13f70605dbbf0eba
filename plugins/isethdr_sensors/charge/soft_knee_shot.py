"""One shot of a pixel with a soft knee. It works like `shot`, but keeps the charge of the
photodiode and the spilled charge apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import Well, flow, linear_limit_e
from isethdr_core.physics.detector.charge_dynamics_noise import draw_charge
from isethdr_core.physics.detector.noise import LARGEST_MEAN_E, rows_per_block
from isethdr_core.physics.detector.random_words import words
from isethdr_core.physics.detector.temporal_modulation import Modulation, constant

from ..noise import shot_noise
from ..readout import captures, converter, shot
from ..sensor_model import SensorModel
from ..timing import exposure_timing
from . import full_well, soft_knee_in_time

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.runs.seeds import Generator

    from ..sensor_model import Reading

# largest spilled charge at which a reading still counts as linear, as a share of the charge at the
# knee
LINEAR_WITHIN = 1e-4
# mean spilled charge below which the charge is not changed, so that the result equals that of a
# linear sensor bit for bit
NOTHING_E = 1e-6


@dataclass(frozen=True)
class SoftKneePixel:
    """A pixel with a photodiode that spills before it is full."""

    # model with one photodiode, which has the capacity of photodiode and overflow capacitor
    # together as its full well
    model: SensorModel
    well: Well  # soft knee of the photodiode
    # for each reading, whether it also reads the spilled charge (in an overflow capacitor), or the
    # photodiode alone
    collects: tuple[bool, ...]


def check_linear(pixel: SoftKneePixel, exposure_s: float) -> None:
    """Refuse a pixel that spills so much that readings of the photodiode alone have no linear code.

    Parameters
    ----------
    pixel : model and soft knee of the sensor.
    exposure_s : longest exposure time, s.

    Raises
    ------
    ConfigError : more than `LINEAR_WITHIN` of the knee spills from the charge of the first code.
    """
    soft = pixel.well
    for reading, all_charge in zip(pixel.model.readings, pixel.collects, strict=True):
        if all_charge:
            continue
        code_e = converter.quantisation_e(reading)
        _, spilled_e = flow(0.0, code_e / exposure_s, exposure_s, soft)
        if not spilled_e < LINEAR_WITHIN * soft.knee_e:
            raise ConfigError(
                f"sensor.knee_e is {soft.knee_e:g}: {float(spilled_e):.3g} e spill from the first"
                f" code of {reading.capture} ({code_e:.3g} e) in {exposure_s:g} s, so no code is"
                f" linear; expected less than {LINEAR_WITHIN * soft.knee_e:.3g} e; type a larger"
                " sensor.knee_e, or a smaller sensor.thermal_e or sensor.knee_e_per_s"
            )


def take_shot(pixel: SoftKneePixel, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
    """Return the captures of one shot.

    Parameters
    ----------
    pixel : model and soft knee of the sensor.
    light, generator : as in `shot.take_shot`.

    Notes
    -----
    Readings of the photodiode alone are `saturated` from the code `top_dn` on, above which they are
    not linear.
    """
    model = pixel.model
    shot.check_generator(model, generator)
    grid, filters, qe, parts = shot.component_electrons(model, light)
    shot.state_errors(model, light)
    [light_e] = exposure_timing.together(model, parts, filters)
    in_time = None
    if all(constant(m) for m, _ in parts):
        ledger.error(
            LINEAR_WITHIN,
            "relative",
            "bound",
            "charge spilled before a reading counts as saturated, light constant over the exposure",
        )
    else:
        in_time = [(m, mean) for m, [mean] in parts]
        soft_knee_in_time.check(in_time, model.exposure_s)
        _state_in_time(pixel)
    ledger.left_out(
        f"dynamics of pixels up to {linear_limit_e(NOTHING_E, model.exposure_s, pixel.well):.4g} e",
        "they spill no charge",
        NOTHING_E,
        "e",
        needless=True,
    )
    raw, saturated = readings(pixel, light_e, generator, in_time=in_time)
    shot_captures = captures.captures(
        model, light, grid, captures.Mosaic(raw, saturated, filters, qe)
    )
    shot_captures["top_dn"].values[:] = tops(pixel)
    return shot_captures


def tops(pixel: SoftKneePixel) -> list[float]:
    """Return the largest code of every reading that still measures light linearly."""
    model = pixel.model
    spilled_e = LINEAR_WITHIN * pixel.well.knee_e
    return [
        converter.top_dn(reading, model.diode_of(reading))
        if all_charge
        else linear_top_dn(reading, model.exposure_s, pixel.well, spilled_e)
        for reading, all_charge in zip(model.readings, pixel.collects, strict=True)
    ]


def _state_in_time(pixel: SoftKneePixel) -> None:
    """State in the ledger the effect of varying light on linear readings, and on the table that
    converts codes of a nonlinear pixel to electrons.
    """
    model = pixel.model
    alone_e = [
        (top - r.black_dn) / r.gain_dn_per_e
        for top, r, every in zip(tops(pixel), model.readings, pixel.collects)
        if not every
    ]
    worst = max(
        (soft_knee_in_time.worst_spill(top_e, model.exposure_s, pixel.well) for top_e in alone_e),
        default=0.0,
    )
    ledger.error(
        worst,
        "relative",
        "bound",
        "charge spilled before a reading counts as saturated, for any variation of the light in"
        " time",
    )
    if not any(pixel.collects):
        ledger.left_out(
            "variation of the light in time, in the table that linearises the response beyond the"
            " knee",
            "the table assumes constant light",
            float("inf"),
            "relative, beyond the knee",
        )


def readings(
    pixel: SoftKneePixel,
    light_e: np.ndarray,
    generator: Generator | None,
    block_rows: int | None = None,
    in_time: Sequence[tuple[Modulation, np.ndarray]] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return `raw` DN and `saturated`, both (capture, y, x), from the mean light electrons (y, x).

    Parameters
    ----------
    pixel : model and soft knee of the sensor.
    light_e : mean electrons of light (y, x) of the whole exposure, constant in time.
    generator : key of the noise; None for a model without noise.
    block_rows : rows computed at a time; the result is the same for any number.
    in_time : components of varying light, [(Modulation, (y, x) electrons at the mean light over
        time), ...]; None: constant light.
    """
    model = pixel.model
    soft = pixel.well
    height, width = light_e.shape
    raw = np.empty((len(model.readings), height, width), converter.raw_dtype(model.readings))
    saturated = np.empty(raw.shape, bool)
    [prnu], [dark], offsets, widths = shot.device_maps(model, generator, height, width)
    key = generator if model.noise else None
    capacity = model.photodiodes[0].full_well_e
    limits = tops(pixel)
    untouched_e = linear_limit_e(NOTHING_E, model.exposure_s, soft)
    starts_s = exposure_timing.starts_s(model, model.photodiodes[0], height)
    varying = soft_knee_in_time.Exposure(
        model.exposure_s,
        soft,
        soft_knee_in_time.untouched_e(NOTHING_E, model.exposure_s, soft),
    )
    step = block_rows or rows_per_block(width)
    for y in range(0, height, step):
        rows = slice(y, min(y + step, height))
        total = arrived(
            light_e[rows] * shot.part(prnu, rows) + shot.part(dark, rows), capacity, key, y
        )
        if in_time is None:
            charge = stays(total, untouched_e, model.exposure_s, soft, key, y)
        else:
            parts = [(m, mean[rows] * shot.part(prnu, rows)) for m, mean in in_time]
            parts.append((Modulation(), np.broadcast_to(shot.part(dark, rows), total.shape)))
            charge = soft_knee_in_time.stays(total, parts, starts_s[rows], varying, key, y)
        for k, (reading, all_charge) in enumerate(zip(model.readings, pixel.collects, strict=True)):
            electrons = np.minimum(total, capacity) if all_charge else charge
            full = total >= capacity
            noise = shot.ReadingNoise(shot.part(offsets[k], rows), shot.part(widths[k], rows))
            dn = shot.read_dn(model, reading, electrons, noise, generator, y)
            saturated[k, rows] = full | (dn >= limits[k])
            raw[k, rows] = converter.companded(dn, reading)
    return raw, saturated


def arrived(
    mean_e: np.ndarray, capacity_e: float, generator: Generator | None, first_row: int
) -> np.ndarray:
    """Return the electrons that arrive in a block of rows, (y, x): Poisson counts, or the means
    without a generator.

    Parameters
    ----------
    mean_e : mean electrons (y, x) of light and dark current.
    capacity_e : largest charge that the pixel holds, electrons; inf: no limit.
    generator : key of the noise; None: no noise.
    first_row : the block's first row, counted from the sensor's upper left pixel.
    """
    if generator is None:
        return np.asarray(mean_e, float)
    mean_e = (
        full_well.limit_mean(mean_e, capacity_e)
        if capacity_e < inf
        else np.minimum(mean_e, LARGEST_MEAN_E)
    )
    return shot_noise.collect(mean_e, generator.stream("pixel", "shot"), first_row)


def stays(
    arrived_e: np.ndarray,
    untouched_e: float,
    exposure_s: float,
    soft: Well,
    generator: Generator | None,
    first_row: int,
) -> np.ndarray:
    """Return the charge that stays in the photodiode, (y, x), electrons. The rest of `arrived_e`
    has spilled.

    Parameters
    ----------
    arrived_e : (y, x) electrons that arrived evenly over the exposure.
    untouched_e : arrived electrons up to which nothing spills.
    exposure_s : exposure time, s.
    soft : `charge_dynamics.Well` of the photodiode.
    generator : key of the noise in the number of electrons that spill; None for the mean.
    first_row : the block's first row, counted from the sensor's upper left pixel.
    """
    some = arrived_e > untouched_e
    if not some.any():
        return arrived_e
    charge = np.array(arrived_e, float)
    if generator is None:
        charge[some] = flow(0.0, charge[some] / exposure_s, exposure_s, soft)[0]
    else:
        height, width = charge.shape
        word = words(generator.stream("pixel", "spill"), first_row, first_row + height, 0, width)
        charge[some] = draw_charge(charge[some], word[some], exposure_s, soft)
    return charge


def linear_top_dn(reading: Reading, exposure_s: float, soft: Well, spilled_e: float) -> float:
    """Return the largest code up to which at most `spilled_e` of the arrived charge have left the
    photodiode.

    Parameters
    ----------
    reading : `Reading` with gain, black level and converter.
    exposure_s : exposure time, s.
    soft : `charge_dynamics.Well` of the photodiode.
    spilled_e : electrons that may have left, at constant light.
    """
    limit = reading.black_dn + reading.gain_dn_per_e * linear_limit_e(spilled_e, exposure_s, soft)
    return min(converter.top_code(reading), float(np.floor(limit)) if reading.bits else limit)
