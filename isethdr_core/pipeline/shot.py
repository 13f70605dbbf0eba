"""Shot: the light on all cameras of a run, and the results of one camera for each noise
realisation.

Captures, pictures and scores come from the cache if an earlier run has kept them there.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from ..data.derived_once import read_only, shared
from ..data.reference_picture import check_developed
from ..data.saturation import with_saturation
from ..data.scores import Score
from ..runs import result_names
from ..runs.reuse import NOTHING_KEPT, Kept, Reuse
from ..runs.seeds import Generator
from .imaging_plan import Imaging


class LightNames(NamedTuple):
    """Names of scene radiance, mixed radiance and light in the cache; None: not cached."""

    scene: str | None = None
    mixed: str | None = None
    light: str | None = None


@dataclass(frozen=True)
class Shot:
    """The light on all cameras of a run, and the key of its noise."""

    light: Any  # irradiance or photocurrent on the sensor plane
    mixed: Any  # mixed radiance from which the light was computed
    scene: Any  # scene radiance with its labels
    generator: Generator  # key of the first noise realisation
    imaging: Imaging  # how the light was made
    reuse: Reuse = NOTHING_KEPT
    names: LightNames = LightNames()
    start: Any = None  # mixed radiance at the start of a shot during which the scene moves

    @property
    def reference(self) -> Any:
        """The mixed radiance that the reference picture shows."""
        return self.mixed if self.start is None else self.start

    def realisation(self, draw: int) -> Generator:
        """Return the key of the noise of one realisation; the first is 0."""
        key = self.generator
        return key.child(f"{key.scene} draw {draw}") if draw else key


def developed(isp: Any, captures: Any) -> Any:
    """Return the picture that the isp makes of the captures, with its saturated pixels marked.

    Raises
    ------
    UnitError : the picture cannot be scored, as `check_developed` raises it.
    """
    picture = isp(captures)
    check_developed(picture, f"the picture of isp {type(isp).__name__}")
    return with_saturation(picture, captures)


@dataclass(frozen=True)
class CameraShot:
    """The results of one camera for a shot.

    The captures, picture and scores of the first realisation are stages of the run (`kept_...`
    returns where they are cached). Further realisations are plain values without a ledger row.
    """

    shot: Shot
    sensor: Any
    isp: Any

    @property
    def _light(self) -> str | None:
        """The name of the light; None if results are not cached."""
        return self.shot.names.light if self.shot.reuse.is_on else None

    @cached_property
    def _sensor(self) -> dict[str, Any] | None:
        return result_names.record(self.sensor)

    @cached_property
    def _isp(self) -> dict[str, Any] | None:
        return result_names.record(self.isp)

    def _captures_name(self, light: str | None, draw: int = 0) -> str | None:
        if light is None:
            return None
        noise = self.shot.realisation(draw)
        key = [noise.seed, noise.device, noise.scene]
        return result_names.named("captures", light, self._sensor, key)

    def _picture_name(self, draw: int = 0) -> str | None:
        captures = self._captures_name(self._light, draw)
        return captures and result_names.named("picture", captures, self._isp)

    def _scores_name(self, metric: Any, draw: int = 0) -> str | None:
        picture = self._picture_name(draw)
        if picture is None:
            return None
        names = self.shot.names
        # reference picture and labels follow from the radiance and the picture's grid
        record = result_names.record(metric)
        return result_names.named("scores", picture, names.mixed, names.scene, record)

    def score_errors_name(self, metric: Any) -> str | None:
        """Return the name of the errors that renderer noise causes in the scores of the first
        picture.
        """
        scores = self._scores_name(metric)
        return scores and result_names.named("score errors", scores)

    def electrons_name(self, settings: Sequence[Any]) -> str | None:
        """Return the name of the electrons behind the captures of the first realisation."""
        captures = self._captures_name(self._light)
        names = self.shot.names
        return captures and result_names.named(
            "electrons", captures, names.mixed, names.scene, settings
        )

    def kept_captures(self) -> Kept:
        """Return where the captures of the first realisation are kept."""
        return Kept(self.shot.reuse, self._captures_name(self._light))

    def kept_picture(self) -> Kept:
        """Return where the picture of the first realisation is kept."""
        return Kept(self.shot.reuse, self._picture_name())

    def kept_scores(self, metric: Any) -> Kept:
        """Return where the scores of the first realisation are kept."""
        return Kept(self.shot.reuse, self._scores_name(metric))

    def values_of(
        self,
        draw: int,
        metrics: Mapping[str, Any],
        scored: Callable[[str, Any], list[Score]],
    ) -> list[Score]:
        """Return the scores of all metrics in one further realisation. Only their values are used.

        Parameters
        ----------
        draw : number of the realisation, from 1.
        metrics : {name: metric} of the run.
        scored : function(name of a metric, picture) -> its scores of that picture.
        """
        reuse = self.shot.reuse
        shot = self.shot

        def captures() -> Any:
            return self.sensor(shot.light, shot.realisation(draw))

        with ExitStack() as until_scored:

            @cache
            def picture() -> Any:
                name = self._captures_name(self._light, draw)
                make = lambda: developed(self.isp, reuse.value(name, captures))
                # as the first picture, so that no metric changes the scores of the next
                made = read_only(reuse.value(self._picture_name(draw), make))
                until_scored.enter_context(shared(made))
                return made

            def of_picture(key: str) -> list[Score]:
                return scored(key, picture())

            scores: list[Score] = []
            for key, metric in metrics.items():
                name = self._scores_name(metric, draw)
                scores += reuse.value(name, partial(of_picture, key))
            return scores

    def picture_of(self, light: Any) -> Any:
        """Return the picture of other light on the same grid, with the noise of the first
        realisation.

        The captures are cached under a name made from the values of the light, so that another isp
        can use them.
        """
        name = None
        if self._light is not None:
            values = np.ascontiguousarray(light.values)
            digest = hashlib.sha256(values.data).hexdigest()
            changed = result_names.named("changed light", self._light, digest, values.dtype.str)
            name = self._captures_name(changed)
        noise = self.shot.generator
        captures = self.shot.reuse.value(name, lambda: self.sensor(light, noise))
        return developed(self.isp, captures)
