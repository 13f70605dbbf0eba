"""Camera of a training: a sensor component of a config, its filters, and the planes of light that
it needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np
from isethdr_isp.network.contract import Contract
from isethdr_isp.network.fields import NetworkFields
from isethdr_isp.network.samples import inputs, shot, unit_e_per_cd_m2

from isethdr_core import generator, quantities
from isethdr_core.config.composition import compose
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.plugins.registry import build_from_config

UNIT_CHANNELS = "GWY"  # the first of these filters in the array gives the unit of the picture
LARGEST_CELL = 8  # largest side of a cell of the filter array, pixels


class Samples(NamedTuple):
    """The captures of one shot in the form of a network's inputs, (plane, y, x) float32."""

    raw: np.ndarray  # electrons of light
    noise: np.ndarray  # noise besides shot noise, electrons rms
    valid: np.ndarray  # 1 where the sample was measured, else 0
    unit_e_per_lux: float  # electrons of the unit channel per lux of daylight


@dataclass(frozen=True, eq=False)
class TrainingCamera:
    """A sensor, and the form of its captures.

    Parameters
    ----------
    sensor : sensor component.
    name : name of the sensor or preset, as typed.
    channels : names of the filters, in the order of its captures.
    cell : rows of one cell of the filter array, for example ("RG", "GB").
    captures : names of the captures.
    apart : whether a network gets every capture separately; otherwise they are merged.
    """

    sensor: Any
    name: str
    channels: tuple[str, ...]
    cell: tuple[str, ...]
    captures: tuple[str, ...]
    apart: bool = False

    @property
    def unit_channel(self) -> str:
        """The filter whose electrons are the unit of a network's picture."""
        return next((c for c in UNIT_CHANNELS if c in self.channels), self.channels[0])

    @property
    def planes(self) -> int:
        """The number of planes of raw samples that a network gets."""
        return len(self.captures) if self.apart else 1

    @property
    def period(self) -> int:
        """The number of pixels after which the array repeats, along both axes."""
        return int(np.lcm(len(self.cell), len(self.cell[0])))

    def masks(self, rows: int, columns: int) -> np.ndarray:
        """Return the masks of the filters (channel, y, x), float32: 1 where a pixel has the filter,
        else 0.

        Parameters
        ----------
        rows, columns : size of the masks, pixels.
        """
        tile = np.array([[self.channels.index(letter) for letter in row] for row in self.cell])
        repeats = -(-rows // len(tile)), -(-columns // len(tile[0]))
        filters = np.tile(tile, repeats)[:rows, :columns]
        return (filters == np.arange(len(self.channels))[:, None, None]).astype(np.float32)

    def response(self, wavelength_nm: Sequence[float]) -> Any:
        """Return the response to light that the sensor adds to a demand."""
        return response_of(self.sensor, self.name, wavelength_nm)

    def plane_weights(self, wavelength_nm: Sequence[float]) -> np.ndarray:
        """Return the weights (plane, wavelength) that convert irradiance to the photocurrent of
        each channel of the response, electrons m-2 s-1, and in the last three planes to X, Y, Z in
        lux.
        """
        response = self.response(wavelength_nm)
        electrons = response.efficiency(np.asarray(wavelength_nm, float))
        electrons = electrons * photons_per_energy(wavelength_nm)
        return np.concatenate([electrons, xyz_weights(wavelength_nm)])

    def shot(self, photocurrent: np.ndarray, wavelength_nm: Sequence[float], seed: int) -> Samples:
        """Return the samples of one noisy shot, with one pixel for each tile of light.

        Parameters
        ----------
        photocurrent : (channel of the response, y, x) photocurrent, electrons m-2 s-1.
        wavelength_nm : centres of the bands for which it was computed, nm.
        seed : seed of the noise. The device differs from shot to shot, so that no fixed pattern is
            learned.
        """
        captures = self.sensor(
            self._light(photocurrent, wavelength_nm), generator(seed, device=f"training {seed}")
        )
        return self.samples(captures)

    def samples(self, captures: Any) -> Samples:
        """Return the samples of captures, as `isp=network` passes them to a model."""
        taken = shot(captures, NetworkFields(), self.apart)
        given = inputs(taken, self.contract())
        unit = unit_e_per_cd_m2(self.contract(), taken)
        return Samples(given["raw"], given["noise"], given["valid"], unit)

    def contract(self) -> Contract:
        """Return the contract of a model file for this camera, without the entries that the
        training adds.
        """
        return Contract(
            cfa="/".join(self.cell),
            channels=self.channels,
            captures=self.captures if self.apart else (),
            unit_channel=self.unit_channel,
            multiple_px=self.period,
        )

    def _light(self, photocurrent: np.ndarray, wavelength_nm: Sequence[float]) -> Any:
        """Return the light on the sensor plane. The throughput of the lens is one steradian, so
        that luminance in cd/m2 equals illuminance in lux.
        """
        response = self.response(wavelength_nm)
        rows, columns = photocurrent.shape[1:]
        pitch_m = self.sensor.pitch_um * 1e-6
        x, y = (quantities.centres(n, n * pitch_m) for n in (columns, rows))
        return quantities.photocurrent(
            photocurrent,
            response.channels,
            x,
            y,
            wavelength_nm,
            response.efficiency(np.asarray(wavelength_nm, float)),
            f_number=2.0,
            focal_length_mm=1e3 * columns * pitch_m,
            throughput_sr=1.0,
            falloff="none",
            field_width=columns * pitch_m,
            field_height=rows * pitch_m,
        )


def camera_of(overrides: Sequence[str], captures: str = "merged") -> TrainingCamera:
    """Return the camera of a composed config.

    Parameters
    ----------
    overrides : overrides of the config, for example sensor=typical_bayer.
    captures : `merged` or `apart`.

    Raises
    ------
    ConfigError : an override has a mistake, the config has several cameras, or the sensor has no
        plain filter array.
    """
    config = compose(list(overrides))
    if not config.get("sensor"):
        raise ConfigError(
            "a network is trained for one sensor, and the config has several cameras; type for"
            " example sensor=typical_bayer"
        )
    sensor = build_from_config("sensor", config.sensor)
    form = sensor.shot_form()
    letters = "".join(form.filters)
    if letters != letters.upper() or max(len(form.filters), len(form.filters[0])) > LARGEST_CELL:
        raise ConfigError(
            f"the filter array {'/'.join(form.filters)} holds unequal pixels or a large cell;"
            f" expected one of at most {LARGEST_CELL} x {LARGEST_CELL} capital letters; type for"
            " example sensor=typical_bayer"
        )
    typed = [o.partition("=")[2] for o in overrides if o.startswith("sensor=")]
    name = typed[-1] if typed else str(config.sensor.name)
    response = response_of(sensor, name, (450.0, 550.0, 650.0))
    # crosstalk between pixels has channels of its own, such as "R astray"
    channels = tuple(channel for channel in response.channels if " " not in channel)
    return TrainingCamera(sensor, name, channels, form.filters, form.captures, captures == "apart")


def response_of(sensor: Any, name: str, wavelength_nm: Sequence[float]) -> Any:
    """Return the response to light that a sensor adds to a demand.

    Parameters
    ----------
    sensor : sensor component.
    name : name of the sensor, for messages.
    wavelength_nm : (band,) band centres of the light, nm.

    Raises
    ------
    ConfigError : the sensor has no noise, so it adds no response.
    """
    demand = sensor.narrow(Demand(wavelength_nm=tuple(map(float, wavelength_nm))))
    if demand.response is None:
        can_have = is_dataclass(sensor) and "noise" in {field.name for field in fields(sensor)}
        advice = "sensor.noise=true" if can_have else "for example sensor=typical_bayer"
        raise ConfigError(
            f"the sensor {name} has no noise; expected one with noise to learn from; type {advice}"
        )
    return demand.response
