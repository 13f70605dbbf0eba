"""Components: the parts of one run, built from its config before any work starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...uncertainty.budget import Allowed

if TYPE_CHECKING:
    from ...motion.settings import MotionSettings
    from ...plugins.protocols import Flare, Isp, Lens, Lighting, Metric, Renderer, Scene, Sensor
    from ...sequence.exposure import Exposure
    from ...uncertainty.budget import Division

SHOWN = "main"  # the lighting of the run, among the versions that a report shows


@dataclass(frozen=True)
class Chain:
    """The components of one run, and the settings that they share."""

    scene: Scene
    renderer: Renderer | None  # None: the scene itself makes its radiance
    lighting: Lighting
    versions: dict[str, Lighting]  # further lightings, which only a report shows
    lens: Lens
    flares: dict[str, Flare]
    cameras: dict[str, Sensor]
    isp: Isp
    metrics: dict[str, Metric]
    draws: int = 1  # noise realisations over which each score is averaged
    allowed: Allowed = Allowed()
    leave_out: bool = True  # False: everything is computed, needed or not
    reported: bool = True  # whether a report shows the scene, under all versions
    unreported: tuple[str, ...] = ()  # configured versions, if no report shows them
    shares: Division | None = None  # division of the error allowed; None: as components declare
    motion: MotionSettings | None = None  # motion during a shot; None: nothing moves
    # exposures that are carried into this frame, by camera; None: the run is no frame of a sequence
    exposures: Mapping[str, Exposure] | None = None

    def components(self) -> list[object]:
        """Return every component, from the scene to the metrics."""
        in_order: tuple[object, ...] = (
            self.scene,
            self.renderer,
            self.lighting,
            *self.versions.values(),
            self.lens,
            *self.flares.values(),
            *self.cameras.values(),
            self.isp,
            *self.metrics.values(),
        )
        return [component for component in in_order if component is not None]
