"""Daylight: the CIE daylight illuminants from three tabulated functions.

This module does not import colour-science, because that import takes a second.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

DAYLIGHT_K = {
    name: kelvin * 1.4388 / 1.4380
    for name, kelvin in {"D50": 5000, "D55": 5500, "D65": 6500, "D75": 7500}.items()
}


def daylight(temperature_k: float) -> Callable[..., Any]:
    """Return the relative spectrum of daylight, 100 at 560 nm, as a function of wavelength in nm.

    The correlated colour temperature is 4000 to 25,000 K.

    CIE 15:2018, eq. 4.6 to 4.11, with linear interpolation between tabulated wavelengths and
    constant values beyond them. M1 and M2 are rounded to three decimals, as the CIE does for its
    published tables. Since the radiation constant was revised, 5000 K stands for 5000 x 1.4388 /
    1.4380 K.
    """
    nm, s0, s1, s2 = _components()
    k = 1e3 / temperature_k
    if temperature_k <= 7000:
        x = 0.244063 + 0.09911 * k + 2.9678 * k**2 - 4.6070 * k**3
    else:
        x = 0.237040 + 0.24748 * k + 1.9018 * k**2 - 2.0064 * k**3
    y = -3.0 * x**2 + 2.870 * x - 0.275
    m = 0.0241 + 0.2562 * x - 0.7341 * y
    m1 = round((-1.3515 - 1.7703 * x + 5.9114 * y) / m, 3)
    m2 = round((0.0300 - 31.4424 * x + 30.0717 * y) / m, 3)
    values = s0 + m1 * s1 + m2 * s2
    return lambda wavelength_nm: np.interp(wavelength_nm, nm, values)


@cache
def _components() -> list[np.ndarray]:
    """Return wavelength_nm, S0, S1, S2 (CIE 15:2018, table 6)."""
    with files(__package__).joinpath("cie_daylight.csv").open() as file:
        rows = list(csv.DictReader(file))
    return [
        np.array([float(r[name]) for r in rows]) for name in ("wavelength_nm", "s0", "s1", "s2")
    ]
