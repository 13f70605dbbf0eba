"""One shot of a pixel with a soft knee: as `shot`, with the photodiode's charge and what spilled from it kept apart."""

from __future__ import annotations

from math import inf

import numpy as np

from isethdr_core import ledger
from isethdr_core.physics.charge_dynamics import flow, linear_limit_e
from isethdr_core.physics.charge_dynamics_noise import draw_charge
from isethdr_core.physics.noise import LARGEST_MEAN_E, rows_per_block
from isethdr_core.physics.random_words import words

from . import captures, converter, full_well, shot, shot_noise

LINEAR_WITHIN = 1e-4        # share of the knee's charge that may have spilled where a reading still counts as linear
NOTHING_E = 1e-6            # mean spill below which the charge is left alone, so that it has the bits of a linear sensor


def take_shot(model, soft, collects, light, generator):
    """Return the captures of one shot under light that is constant over the exposure.

    Parameters
    ----------
    model : `SensorModel` of one photodiode; its full well is the capacity of photodiode and overflow capacitor together.
    soft : `charge_dynamics.Well` of the photodiode.
    collects : per reading, whether it reads the spilled charge as well (an overflow capacitor) or the photodiode alone.
    light, generator : as in `shot.take_shot`.

    Notes
    -----
    Readings of the photodiode alone are `saturated` where they stop being linear: `top_dn` says where.
    """
    grid, filters, qe, [light_e] = shot.light_electrons(model, light)
    shot.state_errors(model, light)
    ledger.error(LINEAR_WITHIN, "relative", "bound", "charge spilled before a reading counts as saturated, light constant over the exposure")
    raw, saturated = readings(model, soft, collects, light_e, generator)
    out = captures.captures(model, light, grid, raw, saturated, filters, qe)
    out["top_dn"].values[:] = tops(model, soft, collects)
    return out


def tops(model, soft, collects) -> list[float]:
    """Return the largest code of every reading that still measures light linearly."""
    spilled_e = LINEAR_WITHIN * soft.knee_e
    return [converter.top_dn(reading, model.diode_of(reading)) if all_charge else linear_top_dn(reading, model.exposure_s, soft, spilled_e)
            for reading, all_charge in zip(model.readings, collects, strict=True)]


def readings(model, soft, collects, light_e, generator, block_rows: int | None = None):
    """Return `raw` DN and `saturated`, both (capture, y, x), from the mean light electrons (y, x); parameters as in `take_shot`."""
    height, width = light_e.shape
    raw = np.empty((len(model.readings), height, width), converter.raw_dtype(model.readings))
    saturated = np.empty(raw.shape, bool)
    [prnu], [dark], offsets, widths = shot.device_maps(model, generator, height, width)
    key, capacity = generator if model.noise else None, model.photodiodes[0].full_well_e
    limits, untouched_e = tops(model, soft, collects), linear_limit_e(NOTHING_E, model.exposure_s, soft)
    step = block_rows or rows_per_block(width)
    for y in range(0, height, step):
        rows = slice(y, min(y + step, height))
        total = arrived(light_e[rows] * shot.part(prnu, rows) + shot.part(dark, rows), capacity, key, y)
        charge = stays(total, untouched_e, model.exposure_s, soft, key, y)
        for k, (reading, all_charge) in enumerate(zip(model.readings, collects, strict=True)):
            electrons = np.minimum(total, capacity) if all_charge else charge
            full = total >= capacity
            dn = shot.read_dn(model, reading, electrons, shot.part(offsets[k], rows), shot.part(widths[k], rows), generator, y)
            saturated[k, rows] = full | (dn >= limits[k])
            raw[k, rows] = converter.companded(dn, reading)
    return raw, saturated


def arrived(mean_e, capacity_e: float, generator, first_row: int) -> np.ndarray:
    """Return the electrons that arrive in a block of rows, (y, x): Poisson counts, or the means without a generator."""
    if generator is None:
        return np.asarray(mean_e, float)
    mean_e = full_well.limit_mean(mean_e, capacity_e) if capacity_e < inf else np.minimum(mean_e, LARGEST_MEAN_E)
    return shot_noise.collect(mean_e, generator.stream("pixel", "shot"), first_row)


def stays(arrived_e, untouched_e: float, exposure_s: float, soft, generator, first_row: int) -> np.ndarray:
    """Return the charge that stays in the photodiode, (y, x); the rest of `arrived_e` spilled.

    Parameters
    ----------
    arrived_e : electrons that arrived evenly over the exposure.
    untouched_e : arrived electrons up to which nothing spills.
    soft : `charge_dynamics.Well`.
    generator : key of the noise of which electrons leave; None for the mean.
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


def linear_top_dn(reading, exposure_s: float, soft, spilled_e: float) -> float:
    """Return the largest code up to which at most `spilled_e` of the arrived charge have left the photodiode."""
    limit = reading.black_dn + reading.gain_dn_per_e * linear_limit_e(spilled_e, exposure_s, soft)
    return min(converter.top_code(reading), float(np.floor(limit)) if reading.bits else limit)
