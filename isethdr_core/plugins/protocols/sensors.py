"""Sensors: their call, and abilities that concern pixels, shots, exposure and memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    import xarray as xr

    from ...pipeline.early_checks import ShotForm
    from ...pipeline.memory import Need
    from ...runs.seeds import Generator
    from ...sequence.exposure import Exposure, SettledExposure


@runtime_checkable
class Sensor(Protocol):
    """Turns light on the sensor plane into captures."""

    def __call__(self, light: xr.DataArray, generator: Generator, /) -> xr.Dataset:
        """Return all captures of one shot.

        Parameters
        ----------
        light : irradiance `([component,] wavelength, y, x)` in W m-2 nm-1, or photocurrent
            `([component,] channel, y, x)` in electrons m-2 s-1; x and y in metres.
        generator : key of all random numbers of the shot.

        Returns
        -------
        Dataset with `raw (capture, y, x)` in DN, and the variables for converting it back to
        electrons (docs/reference/contracts.md).
        """

    def expected(self, light: xr.DataArray, /) -> xr.DataArray:
        """Return mean electrons (capture, y, x) without noise, dark charge included.

        Parameters
        ----------
        light : light on the sensor plane, as for the call.
        """


@runtime_checkable
class DeclaresNoise(Protocol):
    """A sensor that states whether its shots of the same light differ."""

    @property
    def noise(self) -> bool:
        """False: every noise realisation is the same, so one is enough."""
        ...


@runtime_checkable
class HasPixelPitch(Protocol):
    """A sensor with a pixel pitch. The conformance kit makes light of that size, and the sub-frames
    of a moving scene are chosen by it.
    """

    @property
    def pitch_um(self) -> float:
        """Distance between pixel centres, um."""
        ...


@runtime_checkable
class HasPixelCounts(Protocol):
    """A sensor with fields for its numbers of pixel rows and columns."""

    @property
    def rows(self) -> int | None:
        """Return the number of pixel rows; 0 or None where they fill the field."""
        ...

    @property
    def columns(self) -> int | None:
        """Return the number of pixel columns; 0 or None where they fill the field."""
        ...


@runtime_checkable
class ChecksImageSize(Protocol):
    """A sensor whose pixels may not fit into an image."""

    def check_field(self, width_m: float, height_m: float, /) -> None:
        """Raise ConfigError where the pixels do not fit into an image of this size, metres."""


@runtime_checkable
class ChecksFocalLength(Protocol):
    """A sensor whose settings may not fit the focal length of a lens."""

    def check_focal_length(self, focal_length_m: float, /) -> None:
        """Raise ConfigError where a setting contradicts this focal length, metres."""


@runtime_checkable
class TimesItsShot(Protocol):
    """A sensor that knows how long its shot takes."""

    def shot_time_s(self, width_m: float, height_m: float, /) -> float:
        """Return the time from the start of the first row's first exposure to the end of the last
        row's last one, s; with automatic exposure the longest time.

        Parameters
        ----------
        width_m, height_m : size of the image, m.
        """
        ...


@runtime_checkable
class CarriesExposure(Protocol):
    """A sensor with automatic exposure that may follow the light with a delay, over the frames of a
    sequence.
    """

    @property
    def longest_exposure_s(self) -> float | None:
        """Longest automatic exposure, s; None where the exposure is fixed."""
        ...

    def settled_exposure(self, light: xr.DataArray, /) -> SettledExposure:
        """Return the exposure that the sensor chooses for this light by itself, and its limits.

        Parameters
        ----------
        light : light on the sensor plane, as for the call of a sensor.
        """
        ...

    def at_exposure(self, exposure: Exposure, /) -> Sensor:
        """Return the sensor that takes its shots at this exposure and gain, whatever the light."""
        ...


@runtime_checkable
class CountsPixels(Protocol):
    """A sensor that knows the memory of its captures and of the pictures made from them."""

    def pixel_need(self, width_m: float, height_m: float, /) -> Need:
        """Return the memory of the pixels over an image of this size, metres, in a whole run."""
        ...


@runtime_checkable
class ListsCaptures(Protocol):
    """A sensor that knows the form of its captures before it takes a shot."""

    def shot_form(self) -> ShotForm:
        """Return the names of the captures and the filter array."""
        ...


ABILITIES: tuple[type, ...] = (
    DeclaresNoise,
    HasPixelPitch,
    HasPixelCounts,
    ChecksImageSize,
    ChecksFocalLength,
    TimesItsShot,
    CarriesExposure,
    CountsPixels,
    ListsCaptures,
)
