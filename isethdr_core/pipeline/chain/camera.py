"""Camera: one camera of a run at work, and its results."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ...uncertainty.ledger import Ledger

if TYPE_CHECKING:
    from ...data.scores import Score
    from ..shot import CameraShot
    from .components import Chain


@dataclass(frozen=True)
class CameraAtWork:
    """One camera of a run, while its results are computed."""

    chain: Chain  # components of the run
    rows: Ledger  # gets the rows of the camera's stages
    name: str  # name of the camera in the config
    shot: CameraShot  # the light on the camera, and where its results are kept

    def with_own_rows(self) -> CameraAtWork:
        """Return the same camera with an empty ledger, for stages that run side by side."""
        return replace(self, rows=Ledger())


@dataclass
class Camera:
    """The results of one camera: captures, picture, reference picture on the same grid (`truth`),
    labels, and scores.
    """

    captures: Any
    picture: Any
    truth: Any
    labels: Any
    scores: list[Score] = field(default_factory=list)  # means over all noise realisations
    # scores of the first noise realisation, by metric
    scores_of: dict[str, list[Score]] = field(default_factory=dict)

    @property
    def scores_of_first_shot(self) -> list[Score]:
        """The scores of all metrics in the first noise realisation."""
        return [score for scores in self.scores_of.values() for score in scores]
