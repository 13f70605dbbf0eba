"""Demand: the data still needed, passed from the scores back to the scene before any computation.

Any component may have a method `narrow(demand) -> Demand` that returns a smaller demand. It calls
`ledger.left_out` to state the dropped part, the reason, and a bound on the effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .window import wider

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Response:
    """The response of sensors to light, per channel, and the noise that limits how precisely they
    measure it.
    """

    channels: tuple[str, ...]
    efficiency: Callable[[Any], Any]  # wavelength_nm -> (channel, wavelength) electrons per photon
    # area x exposure of the most sensitive photodiode; times photocurrent, it gives electrons
    area_exposure_m2_s: float
    read_noise_e: float  # smallest read noise of all readings
    full_scale_e: float = math.inf  # largest charge that any reading measures
    noise_fraction_allowed: float = 0.1  # error of light, in standard deviations of the noise
    window_m: tuple[float, float] | None = None  # as `Demand.window_m`
    pixel_m: float | None = None  # side of the smallest pixel; None: not known

    @property
    def error_allowed(self) -> float:
        """Relative error of light that stays within `noise_fraction_allowed` even at full scale,
        where the noise is smallest relative to the light.
        """
        if math.isinf(self.full_scale_e):
            return 0.0
        return (
            self.noise_fraction_allowed
            * math.sqrt(self.full_scale_e + self.read_noise_e**2)
            / self.full_scale_e
        )

    def __add__(self, other: Response) -> Response:
        """Return the response of both sensors together, with the smaller noise of the two."""
        return Response(
            self.channels + other.channels,
            lambda w: np.concatenate([self.efficiency(w), other.efficiency(w)]),
            max(self.area_exposure_m2_s, other.area_exposure_m2_s),
            min(self.read_noise_e, other.read_noise_e),
            max(self.full_scale_e, other.full_scale_e),
            min(self.noise_fraction_allowed, other.noise_fraction_allowed),
            wider(self.window_m, other.window_m),
            min((p for p in (self.pixel_m, other.pixel_m) if p is not None), default=None),
        )


@dataclass(frozen=True, eq=False)
class NoiseLimit:
    """The noise of the scene's light that equals the noise of a camera.

    Attributes
    ----------
    weights : {light group: its weight} in the light on the cameras.
    xyz : (3, y, x) standard deviations of X, Y and Z of that light, cd/m2; infinite outside the
        field of all cameras, and where all are saturated.
    exposures : settings chosen by automatic exposure, in any unit.
    steady : whether automatic exposure would choose the same settings for slightly different light.
    """

    weights: Mapping[str, float]
    xyz: np.ndarray
    exposures: np.ndarray = field(default_factory=lambda: np.zeros(0))
    steady: bool = True


@dataclass(frozen=True)
class Demand:
    """The data that the later stages need from the earlier ones. None means all."""

    groups: tuple[str, ...] | None = None  # light groups
    wavelength_nm: tuple[float, ...] | None = None  # band centres
    labels: frozenset[str] = frozenset()  # depth, distance, instance, category, normal
    error_allowed: float = 0.0  # relative error allowed; 0: exact computation
    # response of the sensors; None: light is needed wavelength by wavelength
    response: Response | None = None
    margin: bool = True  # whether tiles beyond the camera's field are needed
    window_m: tuple[float, float] | None = (
        # (width, height) of the image plane that sensors cover, around the axis; inf: all
        None
    )
    stored_error_allowed: float = 0.0  # relative error allowed for rounding of stored radiance
    # function(scene radiance that is nearly right) -> noise of the light that equals the noise of
    # the cameras: a renderer need not be better; None: not known
    noise_limit: Callable[[xr.Dataset], NoiseLimit] | None = field(default=None, compare=False)

    def with_groups(self, groups: Iterable[str]) -> Demand:
        """Return the demand for no other light group than `groups`."""
        remaining = tuple(g for g in groups if self.groups is None or g in self.groups)
        return replace(self, groups=remaining)

    def with_labels(self, *labels: str) -> Demand:
        """Return the demand with `labels` added."""
        return replace(self, labels=self.labels | set(labels))
