"""Converter: from electrons through conversion gain and analog gain to DN with a black level."""

from __future__ import annotations

from collections.abc import Sequence
from math import erfc, exp, hypot, inf, isfinite, pi, sqrt

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError

from ..noise import telegraph_noise
from ..sensor_model import Photodiode, Reading
from . import companding


def converter(
    conversion_gain_uv_per_e: float, analog_gain: float, swing_v: float, bits: int, black_dn: float
) -> dict:
    """Return the fields of a `Reading` that describe the converter.

    The top code 2^bits - 1 is reached at `swing_v` behind the analog gain, code `black_dn` at 0 V.
    With 0 bits the converter is off: raw is electrons, float32, black at 0.

    Parameters
    ----------
    conversion_gain_uv_per_e : microvolts per electron at the floating diffusion.
    analog_gain : volts per volt, a multiplier.
    swing_v : full scale of the converter, V.
    bits : bits of the linear code, 1 to 24; 0 switches the converter off.
    black_dn : code at 0 V, DN.
    """
    for name, value in (
        ("conversion_gain_uv_per_e", conversion_gain_uv_per_e),
        ("analog_gain", analog_gain),
        ("swing_v", swing_v),
    ):
        if not 0 < value < inf:
            raise ConfigError(f"sensor.{name} is {value!r}; expected a finite number above 0")
    if bits != int(bits) or not 0 <= bits <= 24:
        raise ConfigError(
            f"sensor.bits is {bits!r}; expected a whole number within 1..24, or 0 to switch the"
            " converter off"
        )
    swing_e = swing_v / (conversion_gain_uv_per_e * 1e-6 * analog_gain)
    if bits == 0:
        return {"bits": 0, "gain_dn_per_e": 1.0, "black_dn": 0.0, "swing_e": swing_e}
    top = 2**bits - 1
    if not 0 <= black_dn < top:
        raise ConfigError(
            f"sensor.black_dn is {black_dn!r}; expected at least 0 and below the top code {top}"
        )
    return {
        "bits": int(bits),
        "gain_dn_per_e": (top - black_dn) / swing_e,
        "black_dn": float(black_dn),
        "swing_e": swing_e,
    }


def top_code(reading: Reading) -> float:
    """Return the largest output value of the converter, DN; infinite without a limit."""
    if reading.bits:
        return float(2**reading.bits - 1)
    return float(reading.black_dn + reading.gain_dn_per_e * reading.swing_e)


def top_dn(reading: Reading, diode: Photodiode) -> float:
    """Return the largest code that still measures light, DN: the top code, or the code of the full
    well if that is smaller.
    """
    full = reading.black_dn + reading.gain_dn_per_e * diode.full_well_e
    return min(
        top_code(reading), float(np.floor(full + 1e-6)) if isfinite(full) and reading.bits else full
    )


def quantisation_e(reading: Reading) -> float:
    """Return the step of one code in electrons; 0 when the converter is off. The variance of the
    rounding error is step^2 / 12.
    """
    return 1.0 / reading.gain_dn_per_e if reading.bits else 0.0


def raw_dtype(readings: Sequence[Reading]) -> type:
    """Return the type that holds every reading's codes: uint16, uint32, or float32 when a converter
    is off.
    """
    if any(reading.bits == 0 for reading in readings):
        return np.float32
    tops = [
        reading.companding[-1][1] if reading.companding else top_code(reading)
        for reading in readings
    ]
    return np.uint16 if max(tops) < 2**16 else np.uint32


def digitise(electrons: np.ndarray, reading: Reading) -> np.ndarray:
    """Return linear DN, float64 and whole numbers when the converter is on, within 0 and the top
    code.
    """
    dn = reading.black_dn + reading.gain_dn_per_e * electrons
    if reading.inl_dn:
        dn = dn + integral_nonlinearity_dn(dn, reading)
    if not reading.bits:
        return np.minimum(dn, top_code(reading))  # values below black are kept
    dn += 0.5
    return np.clip(np.floor(dn, out=dn), 0.0, top_code(reading), out=dn)


def integral_nonlinearity_dn(dn: np.ndarray, reading: Reading) -> np.ndarray:
    """Return the deviation of the converter above a straight line, DN: one period of a sine from
    black to the top code.

    The deviation is 0 at both ends, so that gain and black level do not change. The shape is an
    assumption; its amplitude is `inl_dn`.
    """
    phase = (dn - reading.black_dn) / (top_code(reading) - reading.black_dn)
    return reading.inl_dn * np.sin(2 * np.pi * np.clip(phase, 0.0, 1.0))


def check_reading(reading: Reading) -> None:
    """Refuse a converter whose codes do not increase with the charge."""
    if reading.inl_dn:
        largest = (top_code(reading) - reading.black_dn) / (2 * np.pi)
        if not abs(reading.inl_dn) < largest:
            raise ConfigError(
                f"sensor.inl_dn is {reading.inl_dn!r}; expected less than {largest:.4g} DN, so that"
                " codes still increase"
            )
    if reading.companding:
        if not reading.bits:
            raise ConfigError(
                "sensor.companding is set, but without a converter (sensor.bits=0) there are no"
                " codes; type sensor.bits=12"
            )
        companding.table(reading.companding, top_code(reading))


def check_codes(reading: Reading, diode: Photodiode) -> None:
    """Raise ConfigError if a full well is less than one code, because every reading would be 0."""
    if top_dn(reading, diode) <= reading.black_dn:
        raise ConfigError(
            f"sensor {reading.capture} has a full well of {diode.full_well_e:g} e and codes of"
            f" {quantisation_e(reading):.4g} e; expected more than one code below the full well;"
            " type a larger sensor.full_well_e, a smaller sensor.swing_v, or sensor.bits=0"
        )


def state_nonlinearity(reading: Reading) -> None:
    """State the nonlinearity in the ledger, because no image processing corrects it."""
    if reading.inl_dn:
        ledger.error(
            abs(reading.inl_dn) / reading.gain_dn_per_e,
            "electrons",
            "bound",
            f"integral non-linearity of {reading.capture}",
        )


def companded(linear_dn: np.ndarray, reading: Reading) -> np.ndarray:
    """Return the codes that leave the sensor, DN; equal to `linear_dn` without companding."""
    return (
        companding.compand(linear_dn, reading.companding, top_code(reading))
        if reading.companding
        else linear_dn
    )


def code_steps(reading: Reading, dn: np.ndarray) -> np.ndarray:
    """Return the step, in linear DN, between the codes that leave the sensor at linear `dn`."""
    if not reading.companding:
        return np.ones_like(dn)
    linear, coded = companding.table(reading.companding, top_code(reading))
    slope = np.diff(linear) / np.diff(coded)
    return slope[np.clip(np.searchsorted(linear, dn, side="right") - 1, 0, len(slope) - 1)]


def check_black_level(reading: Reading) -> None:
    """State in the ledger the largest bias of the mean of a dark pixel that clipping at code 0
    causes.
    """
    rms = hypot(
        reading.read_noise_e,
        reading.row_noise_e,
        telegraph_noise.rms_e(reading.telegraph_e, reading.telegraph_percent),
        reading.dsnu_e,
        reading.column_e,
        reading.row_e,
    )
    if not reading.bits or rms == 0 or not isfinite(reading.swing_e):
        return
    black_e = reading.black_dn / reading.gain_dn_per_e
    t = black_e / rms
    # E[max(0, -black - n)], n normal
    bias = rms * (exp(-t * t / 2) / sqrt(2 * pi) - t * erfc(t / sqrt(2)) / 2)
    if bias > 1e-3 * rms:
        ledger.left_out(
            f"readings of {reading.capture} below code 0",
            f"black_dn is only {t:.2g} times the noise; raise sensor.black_dn",
            bias,
            "electrons, mean of a dark pixel",
        )
