"""Exposure control: automatic exposure that settles over the frames of a sequence.

A camera meters a frame, and the new exposure takes effect some frames later. The exposure moves by
a share of the way to its goal, so that the brightness of the picture neither flickers nor
oscillates. Some frames are therefore overexposed when a car leaves a tunnel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, log2

from ..errors import ConfigError
from .exposure import Exposure, SettledExposure

MOST_DELAY_FRAMES = 1000
SETTLED_STOPS = 1e-9  # nearer than this to its goal, an exposure is settled


@dataclass(frozen=True)
class ExposureControl:
    """How an automatic exposure follows the light from frame to frame.

    Notes
    -----
    x[n] = x[n - 1] + s (x*[n - d] - x[n - 1]). Here x is the logarithm of exposure time x gain, and
    x*[n - d] the x to which the light of frame n - d would settle. After a step of the light, (1 -
    s)^k of the step remains k frames after the first reaction. The light before frame 0 is taken to
    be that of frame 0.

    References
    ----------
    libcamera, AgcMeanLuminance::filterExposure: a share of 0.2 of the way per frame (there of the
    exposure itself, and larger within 20 % of the goal).
    """

    share_per_frame: float = 0.2  # share of the way to the settled exposure, in logarithms
    delay_frames: int = 2  # from the metered frame to the first one at the exposure that follows
    most_stops_per_frame: float = inf  # largest change from frame to frame, factors of two

    def __post_init__(self) -> None:
        if not (_is_number(self.share_per_frame) and 0 < self.share_per_frame <= 1):
            raise ConfigError(
                f"exposure.share_per_frame is {self.share_per_frame!r}; expected a share above 0,"
                " at most 1; type for example exposure.share_per_frame=0.2"
            )
        whole = isinstance(self.delay_frames, int) and not isinstance(self.delay_frames, bool)
        if not (whole and 1 <= self.delay_frames <= MOST_DELAY_FRAMES):
            raise ConfigError(
                f"exposure.delay_frames is {self.delay_frames!r}; expected a whole number of frames"
                f" from 1 to {MOST_DELAY_FRAMES}; type for example exposure.delay_frames=2"
            )
        if not (_is_number(self.most_stops_per_frame) and self.most_stops_per_frame > 0):
            raise ConfigError(
                f"exposure.most_stops_per_frame is {self.most_stops_per_frame!r}; expected factors"
                " of two above 0; type for example exposure.most_stops_per_frame=1"
            )

    def next_exposure(self, settled: Sequence[SettledExposure]) -> Exposure:
        """Return the exposure of the frame that follows.

        Parameters
        ----------
        settled : settled exposure for the light of each frame so far, from frame 0; at least one.
        """
        goal = settled[0]
        stops = _Stops.of(goal)
        for frame in range(1, len(settled) + 1):
            goal = settled[max(frame - self.delay_frames, 0)]
            stops = self._moved(stops, _Stops.of(goal))
        if stops == _Stops.of(goal):
            return goal.exposure
        nearest = goal.nearest(2.0**stops.product)
        return replace(nearest, ratios=tuple(2.0**r for r in stops.ratios))

    def _moved(self, stops: _Stops, goal: _Stops) -> _Stops:
        way = [b - a for a, b in zip(stops.all, goal.all, strict=True)]
        if max(map(abs, way)) <= SETTLED_STOPS:
            return goal
        most = self.most_stops_per_frame
        product = min(max(self.share_per_frame * way[0], -most), most)
        ratios = [a + self.share_per_frame * w for a, w in zip(stops.ratios, way[1:], strict=True)]
        return _Stops(stops.product + product, tuple(ratios))


@dataclass(frozen=True)
class _Stops:
    """Logarithms to base 2 of an exposure."""

    product: float
    ratios: tuple[float, ...]

    @classmethod
    def of(cls, settled: SettledExposure) -> _Stops:
        exposure = settled.exposure
        return cls(log2(exposure.product_s), tuple(map(log2, exposure.ratios)))

    @property
    def all(self) -> tuple[float, ...]:
        return (self.product, *self.ratios)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
