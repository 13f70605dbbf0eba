"""Renderers: their call, field and fog, samples that are continued, and estimates of their cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

from .scenes import CountsTiles, KnowsItsBands

if TYPE_CHECKING:
    import xarray as xr

    from ...data.scene_description import SceneDescription
    from ...pipeline.demand import Demand
    from ...pipeline.memory import Frame
    from ...runs.sample_accumulation import Known


@runtime_checkable
class Renderer(Protocol):
    """Makes scene radiance from a scene description."""

    def __call__(self, description: SceneDescription, demand: Demand, /) -> xr.Dataset:
        """Return scene radiance with the light groups, bands and labels that the demand asks for.

        Parameters
        ----------
        description : the scene, lengths in metres.
        demand : the data that later stages need.

        Returns
        -------
        Dataset with `radiance (light_group, wavelength, y, x)`, float32, W m-2 sr-1 nm-1.
        """


@runtime_checkable
class ChecksCameraField(Protocol):
    """A renderer that cannot put its tiles on every field."""

    def check_field(self, width: float, height: float, projection: str, /) -> None:
        """Raise ConfigError where the tiles do not fit the camera's field.

        Parameters
        ----------
        width, height : size of the field, in the unit of x and y.
        projection : "tangent" or "equidistant".
        """


@runtime_checkable
class RendersMargin(Protocol):
    """A renderer that makes tiles beyond the camera's field when the demand asks for them."""

    @property
    def margin(self) -> float:
        """Width of the border on each side, as a share of the field."""
        ...


@runtime_checkable
class RendersFog(Protocol):
    """A renderer that states whether it renders fog. Others are refused for scenes with fog."""

    RENDERS_FOG: ClassVar[bool]  # True: `SceneDescription.fog` is rendered


@runtime_checkable
class NamesItsEffort(Protocol):
    """A renderer with fields that change only the accuracy of the radiance and the time for it."""

    # names of these fields; stored radiance with larger values is also used
    effort_fields: ClassVar[Sequence[str]]


@runtime_checkable
class AccumulatesSamples(Protocol):
    """A renderer that continues from stored radiance instead of starting again.

    It is called with a third argument. The attribute `path_span` of its radiance, {group: [first,
    end]}, states the samples of each light group. Renderings with different samples are pooled.
    """

    def __call__(
        self,
        description: SceneDescription,
        demand: Demand,
        known: Mapping[str, Known],
        /,
    ) -> xr.Dataset:
        """Return scene radiance of further samples.

        Parameters
        ----------
        description : description of the scene.
        demand : groups, bands and labels that are needed.
        known : {light group: `isethdr_core.runs.sample_accumulation.Known`}, the stored samples of
            each requested light group.
        """
        ...

    def enough(self, paths: int, noise: float | None, /) -> bool:
        """Return whether a light group needs no more samples.

        Parameters
        ----------
        paths : samples per tile so far.
        noise : relative noise of their mean; None if no light was found.
        """
        ...


@runtime_checkable
class MeetsNoiseLimit(Protocol):
    """A renderer that stops at a share of the cameras' noise (`Demand.noise_limit`).

    The attribute `limit_share` of its radiance states the share. Stored radiance with that share or
    a smaller one is reused.
    """

    def limit_share(self) -> float | None:
        """Return the allowed share of the cameras' noise; None if the fields select another
        criterion.
        """
        ...


@runtime_checkable
class EstimatesSamples(Protocol):
    """A renderer that can estimate its number of samples."""

    def expected_paths(self, paths: int, noise: float | None, /) -> float:
        """Return the expected number of samples per tile of one light group.

        Parameters
        ----------
        paths : samples per tile of an earlier rendering.
        noise : relative noise of these samples.
        """
        ...


@runtime_checkable
class EstimatesRendering(Protocol):
    """A renderer that can estimate the time for a frame without stored radiance."""

    def rendering_s(self, frame: Frame, groups: int | None, /) -> float | None:
        """Return seconds; None without an estimate.

        `isethdr_core.pipeline.runtime_estimate.machine_speed` tells how fast this processor is.

        Parameters
        ----------
        frame : tiles and bands that will be rendered.
        groups : number of light groups; None if it is not known yet.
        """
        ...


@runtime_checkable
class CountsRenderMemory(Protocol):
    """A renderer that knows approximately how much memory it takes."""

    def memory_bytes(self, frame: Frame, /) -> float:
        """Return the bytes that rendering a frame takes, the scene included.

        Parameters
        ----------
        frame : tiles and bands that will be rendered.
        """
        ...


ABILITIES: tuple[type, ...] = (
    KnowsItsBands,
    CountsTiles,
    ChecksCameraField,
    RendersFog,
    RendersMargin,
    NamesItsEffort,
    AccumulatesSamples,
    MeetsNoiseLimit,
    EstimatesSamples,
    EstimatesRendering,
    CountsRenderMemory,
)
