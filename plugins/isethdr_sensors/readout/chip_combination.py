"""Combination on the chip: all captures of a shot become one linear code of 20 or 24 bits.

The black level and mean dark charge are subtracted from every reading, and the reading is scaled to
electrons of the most sensitive photodiode. From the least to the most sensitive, each reading
replaces the previous ones, with a weight that falls linearly from 1 to 0 between two shares of its
own full scale. The weight depends on the noisy reading t, which biases the result by
Var t / (width of the ramp).

The capture has a response table: for each linear code, the electrons and the variance of one
reading, including the steps of code and companding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import floor

import numpy as np

from isethdr_core.errors import ConfigError

from ..noise import telegraph_noise
from ..noise.dark_current import dark_electrons
from ..sensor_model import Reading, SensorModel
from . import companding, converter

CAPTURE = "combined"
# shares of a reading's full scale between which its weight falls from 1 to 0 (assumption)
RAMP = (0.8, 0.95)
ENTRIES = 2000  # number of entries of the response table above 0 e, at equal logarithmic steps
BITS = (20, 24)  # allowed numbers of bits
BELOW_DN = 1000.0  # linear DN below 0 at which the table begins if the black level is 0


@dataclass(frozen=True)
class Source:
    """One reading, in electrons of the most sensitive photodiode."""

    number: int  # number of the reading in the model
    diode: int  # number of the photodiode in the model
    ratio: float  # light of the photodiode / light of the most sensitive photodiode
    dark_e: float  # mean dark charge, own electrons
    top_e: float  # full scale, own electrons, dark charge included
    noise_e2: float  # variance of a reading without shot noise, own electrons squared


def sources(model: SensorModel) -> list[Source]:
    """Return all readings, the least sensitive photodiode first. Of the readings of one photodiode,
    the one with the largest full scale is first.
    """
    exposed = [d.fill_factor * d.exposure_share for d in model.photodiodes]
    out = []
    for number, reading in enumerate(model.readings):
        diode = model.diode_of(reading)
        top = (converter.top_dn(reading, diode) - reading.black_dn) / reading.gain_dn_per_e
        step_e2 = converter.quantisation_e(reading) ** 2 / 12
        traps_e = telegraph_noise.rms_e(reading.telegraph_e, reading.telegraph_percent)
        read_e2 = reading.read_noise_e**2 + reading.row_noise_e**2 + traps_e**2
        noise_e2 = read_e2 * model.noise + step_e2
        out.append(
            Source(
                number,
                reading.diode,
                exposed[reading.diode] / max(exposed),
                dark_electrons(diode.dark_e_per_s, model.exposure_of(diode), model.temperature_c),
                top,
                noise_e2,
            )
        )
    return sorted(out, key=lambda s: (s.ratio, -s.top_e))


def check(model: SensorModel) -> None:
    """Refuse models with readings that cannot be combined.

    Raises
    ------
    ConfigError : there is a single reading, or a reading without a converter, or the knees of the
        companding do not end at the top code or are not whole codes.
    """
    bits = model.combine_bits
    if len(model.readings) < 2:
        raise ConfigError(
            f"sensor.combine_bits is {bits}, and the sensor takes one capture; expected several;"
            " type sensor.combine_bits=0, or sensor=dual_gain, split_pixel or staggered"
        )
    if any(not reading.bits for reading in model.readings):
        raise ConfigError(
            f"sensor.combine_bits is {bits}, and sensor.bits=0 makes no codes to combine; type"
            " sensor.bits=12"
        )
    top = 2**bits - 1
    if knees := model.combine_companding:
        companding.table(knees, top)
        if knees[-1][0] != top:
            raise ConfigError(
                f"sensor.companding ends at {knees[-1][0]:g} DN; expected its last knee at the top"
                f" code {top} of sensor.combine_bits={bits}"
            )
        if any(code != int(code) for _, code in knees):
            raise ConfigError(
                f"sensor.companding is {knees!r}; expected whole companded codes, so that decoding"
                " gives each of them back"
            )


def combined_model(model: SensorModel) -> SensorModel:
    """Return the model of the one capture that leaves the chip: its code over the whole range."""
    order = sources(model)
    best = order[-1]
    reading = model.readings[best.number]
    diode = model.photodiodes[best.diode]
    reach_e = max((s.top_e - s.dark_e) / s.ratio for s in order) + best.dark_e
    # the black level in electrons is that of the reading, so that it leaves as much room for noise
    black_e = reading.black_dn / reading.gain_dn_per_e
    top = 2**model.combine_bits - 1
    # A step of the code is the finest reading's step divided by a whole number. With any other
    # step, rounding to the code after rounding to the reading would leave a periodic pattern.
    largest = (top - 1) / (reach_e + black_e)
    fits = largest >= reading.gain_dn_per_e
    gain = reading.gain_dn_per_e * floor(largest / reading.gain_dn_per_e) if fits else largest
    black = float(round(black_e * gain)) if fits else float(floor(black_e * gain))
    code = replace(
        reading,
        capture=CAPTURE,
        diode=0,
        bits=model.combine_bits,
        black_dn=black,
        gain_dn_per_e=gain,
        swing_e=(top - black) / gain,
        inl_dn=0.0,
        companding=model.combine_companding,
    )
    wide_model = replace(diode, full_well_e=reach_e)
    return replace(model, photodiodes=(wide_model,), readings=(code,), combine_bits=0)


def combine(
    model: SensorModel, raw: np.ndarray, saturated: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the codes (1, y, x) that leave the chip, and which of them (1, y, x) are saturated.

    Parameters
    ----------
    model : `SensorModel` with the bits of the combined code.
    raw, saturated : (capture, y, x) linear DN of the readings, and which of them are saturated.
    """
    order = sources(model)
    combined = combined_model(model)
    [code] = combined.readings
    value = None
    last_lost = None
    for source in order:
        reading_e = _electrons(model.readings[source.number], raw[source.number])
        light_e = (reading_e - source.dark_e) / source.ratio
        if value is None:
            value = light_e
            last_lost = saturated[source.number].copy()
            continue
        share = weight(reading_e, source)
        value = share * light_e + (1 - share) * value
        # read noise may take a full well below the top of the reading
        last_lost = np.where(saturated[source.number], last_lost, last_lost & (share < 1))
    top = converter.top_code(code)
    dn = code.black_dn + code.gain_dn_per_e * (value + order[-1].dark_e)
    dn = np.where(last_lost, top, np.clip(np.floor(dn + 0.5), 0.0, top))
    codes = converter.companded(dn, code).astype(converter.raw_dtype([code]))
    return codes[None], last_lost[None]


def weight(own_e: np.ndarray, source: Source) -> np.ndarray:
    """Return the weight, 0 to 1, of a reading at `own_e` of its own electrons."""
    begin, end = (share * source.top_e for share in RAMP)
    return np.clip((end - own_e) / (end - begin), 0.0, 1.0)


def bias_e(source: Source) -> float:
    """Return the largest bias due to the noise of the weight of `source` within its ramp, in
    electrons of the most sensitive photodiode.
    """
    end = RAMP[1] * source.top_e
    return (end + source.noise_e2) / (end - RAMP[0] * source.top_e) / source.ratio


def response(model: SensorModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the response table (entry,): linear DN, arriving electrons including dark charge, and
    the variance of one reading, e^2.

    The variance is that of a reading with the entry as its mean. Readings of one photodiode share
    their shot noise.
    """
    order = sources(model)
    [code] = combined_model(model).readings
    dark_e = order[-1].dark_e
    black_e = code.black_dn / code.gain_dn_per_e
    reach_e = combined_model(model).photodiodes[0].full_well_e
    least_e = max(1e-3, 1 / code.gain_dn_per_e)
    below_e = black_e or BELOW_DN / code.gain_dn_per_e
    electrons = np.concatenate(
        [np.linspace(-below_e, 0.0, 3), np.geomspace(least_e, reach_e, ENTRIES)]
    )
    shares = np.zeros((len(order), len(electrons)))
    for k, source in enumerate(order):
        charge_e = (electrons - dark_e) * source.ratio + source.dark_e
        share = weight(charge_e, source) if k else np.ones_like(electrons)
        shares[:k] *= 1 - share
        shares[k] = share
    variance = np.zeros_like(electrons)
    for diode in {source.diode for source in order}:
        positions = [k for k, source in enumerate(order) if source.diode == diode]
        of = order[positions[0]]
        charge_e = np.maximum((electrons - dark_e) * of.ratio + of.dark_e, 0.0)
        shot = charge_e * model.noise / of.ratio**2
        variance += shares[positions].sum(0) ** 2 * shot
        variance += sum(shares[k] ** 2 * order[k].noise_e2 / of.ratio**2 for k in positions)
    dn = code.black_dn + code.gain_dn_per_e * electrons
    # The codes of the most sensitive reading coincide with codes that leave the chip. Where this
    # reading is used alone, rounding adds variance only if the codes are wider than those of the
    # reading.
    own_step = np.where(
        shares[-1] == 1, converter.quantisation_e(model.readings[order[-1].number]), 0
    )
    step = converter.code_steps(code, dn) / code.gain_dn_per_e
    variance += np.maximum(step**2 - own_step**2, 0.0) / 12
    return dn, electrons, variance


def _electrons(reading: Reading, raw: np.ndarray) -> np.ndarray:
    return (raw.astype(float) - reading.black_dn) / reading.gain_dn_per_e
