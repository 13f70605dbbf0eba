"""A lens of plugin API 3 that states the errors of its light, tile by tile."""

from dataclasses import dataclass

import numpy as np
from isethdr_core import Component, hookimpl
from isethdr_optics import IdealLens

ISETHDR_PLUGIN_API = 3


@dataclass(frozen=True)
class Measuring:
    """A lens without blur; its errors are a thousandth and a hundredth of the light."""

    def __call__(self, mixed, flares=()):
        """Return irradiance."""
        return IdealLens()(mixed, flares=flares)

    def spread_errors(self, mixed, flares, weights, response=None):
        """Return standard deviation and bound, each (channel, y, x)."""
        light = np.tensordot(weights, self(mixed, flares=flares).values, axes=1)
        return 1e-3 * light, 1e-2 * light


@dataclass(frozen=True)
class Doubting(IdealLens):
    """The ideal lens with twice the errors that its own class states."""

    def spread_errors(self, mixed, flares, weights, response=None):
        """Return the errors of the class above, twice."""
        errors = super().spread_errors(mixed, flares, weights, response)
        return 2 * errors.deviation + 1.0, 2 * errors.bound + 1.0


@hookimpl
def isethdr_components():
    return [Component("lens", "acme_measuring", Measuring), Component("lens", "acme_doubting", Doubting)]
