"""Dark current: thermal electrons, doubling every 8 K."""

from __future__ import annotations

REFERENCE_C = 60.0  # temperature at which a sensor's dark_e_per_s is stated (assumption)
# temperature rise that doubles the dark current (assumption: common for pinned photodiodes near
# room temperature and above; 5 to 10 K are reported)
DOUBLING_K = 8.0


def dark_electrons(dark_e_per_s: float, exposure_s: float, temperature_c: float) -> float:
    """Return the mean dark charge of an exposure, electrons.

    Parameters
    ----------
    dark_e_per_s : dark current at 60 degrees Celsius, electrons per second.
    exposure_s : exposure time, s.
    temperature_c : temperature of the sensor, degrees Celsius.
    """
    return dark_e_per_s * exposure_s * 2.0 ** ((temperature_c - REFERENCE_C) / DOUBLING_K)
