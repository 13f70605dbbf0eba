"""Soft knee: fields of a photodiode with an overflow current that grows exponentially."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import Well

if TYPE_CHECKING:
    from isethdr_core.physics.detector.charge_dynamics import Well

    from ..imaging_sensor import ImagingSensor

# temperature at which `thermal_e` is stated, degrees Celsius and kelvins
REFERENCE_C = 60.0
REFERENCE_K = 333.15


@runtime_checkable
class HasSoftKnee(Protocol):
    """A sensor with a photodiode that loses charge before it is full. Its response is nonlinear."""

    def well(self) -> Well:
        """Return the soft knee of its pixels."""
        ...


def well(knee_e: float, thermal_e: float, knee_e_per_s: float, temperature_c: float) -> Well:
    """Return the `charge_dynamics.Well` of these fields at the temperature of the sensor.
    `thermal_e` is proportional to the absolute temperature.

    Parameters
    ----------
    knee_e : charge at which the overflow current is `knee_e_per_s`, electrons.
    thermal_e : additional charge that raises the overflow current by the factor e, at 60 C,
        electrons.
    knee_e_per_s : overflow current at the knee, electrons per second.
    temperature_c : temperature of the sensor, degrees Celsius.
    """
    return Well(knee_e, thermal_e * (1 + (temperature_c - REFERENCE_C) / REFERENCE_K), knee_e_per_s)


def check(sensor: ImagingSensor) -> None:
    """Refuse fields of `sensor` that a pixel with a soft knee does not support, or that describe no
    knee. Blooming is refused because overflowing charge has its own path here.
    """
    for name, off in (
        ("combine_bits", 0),
        ("black_rows", 0),
        ("telegraph_percent", 0.0),
        ("defect_e_per_s", inf),
    ):
        if getattr(sensor, name) != off:
            raise ConfigError(
                f"sensor.{name} is {getattr(sensor, name)}, but the model of a soft knee does not"
                f" include it; type sensor.{name}={off}"
            )
    for name in ("knee_e", "thermal_e", "knee_e_per_s"):
        value = getattr(sensor, name)
        if not 0 < value < inf:
            raise ConfigError(
                f"sensor.{name} is {value!r}; expected a finite number above 0; type"
                f" sensor.{name}=<number>"
            )
    if sensor.blooming_percent:
        raise ConfigError(
            f"sensor.blooming_percent is {sensor.blooming_percent!r}; charge beyond the knee leaves"
            " through the overflow path of this pixel; type sensor.blooming_percent=0, or use"
            " another sensor"
        )
