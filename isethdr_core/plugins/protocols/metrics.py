"""Metrics: their call, and faster ways to the same scores."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from ...data.scores import Score


@runtime_checkable
class Metric(Protocol):
    """Scores a picture."""

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None, /
    ) -> list[Score]:
        """Return scores.

        Parameters
        ----------
        picture : picture of the camera.
        truth : reference picture, without the camera's errors, on the same grid of pixels.
        labels : labels per pixel: at least those that `narrow` asks for and the scene has, and
            those that other components ask for; without variables if there are none. None for a
            part of a picture, which only a metric with `MEAN_OF_PARTS` scores.
        """


@runtime_checkable
class HasMeanOfParts(Protocol):
    """A metric that states whether its score is nearly the mean of the scores of parts."""

    MEAN_OF_PARTS: ClassVar[bool]  # True: it is nearly this mean, and needs no labels


@runtime_checkable
class HasWhite(Protocol):
    """A metric that compares pictures against the display white of the whole reference picture
    (`display_view.white_cd_m2`), unless its field `white_cd_m2` is above 0.
    """

    WHITE_SCORE: ClassVar[str]  # name of the score that gives the white it used, in cd/m2

    @property
    def white_cd_m2(self) -> float:
        """Display white, cd/m2; 0 selects the white of the reference picture."""
        ...


@runtime_checkable
class ScoresFurther(Protocol):
    """A metric that scores a further noise realisation of a picture quickly.

    It computes how the score differs from that of the first realisation, which takes less time than
    the whole score.
    """

    def further(
        self,
        picture: xr.Dataset,
        first: xr.Dataset,
        truth: xr.Dataset,
        labels: xr.Dataset | None,
        /,
    ) -> list[Score]:
        """Return the scores of a further noise realisation. Only their values are used.

        Parameters
        ----------
        picture : the further realisation.
        first : the first realisation on the same grid, which the metric has scored in full.
        truth : reference picture of both.
        labels : labels per pixel: at least those that `narrow` asks for and the scene has, and
            those that other components ask for; without variables if there are none.
        """


@runtime_checkable
class ScoresParts(Protocol):
    """A metric with `MEAN_OF_PARTS` that scores all parts of a picture in one pass."""

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray, /
    ) -> list[list[Score]]:
        """Return the scores of the frame for each of its parts. Only their values are used.

        Parameters
        ----------
        picture : picture of the camera.
        truth : reference picture, without the camera's errors, on the same grid of pixels.
        part : (y, x), number of the part of each pixel, from 0.
        """


ABILITIES: tuple[type, ...] = (
    HasMeanOfParts,
    HasWhite,
    ScoresFurther,
    ScoresParts,
)
