"""Contracts of components: the calls of each kind, and the optional abilities.

The first part holds one Protocol per kind. The second part holds one small Protocol per optional
ability. The core tests `isinstance(component, Ability)`, and uses the ability if it is present.
When a plugin is loaded, `abilities.check` compares its classes with these Protocols: a misspelt
method, or one with parameters that the core could not pass, is an error.

A `/` in a signature means that the core passes the preceding parameters by position. A plugin may
name them freely. All others may be passed by name.

Members other than methods are class attributes, or fields of the dataclass. A class withdraws an
ability of its base class by setting the method to None.

Python caches the classes that have all methods of a Protocol. Do not remove a method from a class
after the first `isinstance` test.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias, runtime_checkable

if TYPE_CHECKING:
    from os import PathLike

    import numpy as np
    import numpy.typing as npt
    import xarray as xr

    from ..data.scene_description import SceneDescription
    from ..data.scores import Score
    from ..pipeline.demand import Demand, Response
    from ..pipeline.early_checks import ShotForm
    from ..pipeline.imaging_plan import FieldAhead, ImagingOutline, LightBudget
    from ..pipeline.memory import Frame, Need
    from ..runs.sample_accumulation import Known
    from ..runs.seeds import Generator
    from ..sequence.exposure import Exposure, SettledExposure
    from ..uncertainty.error_terms import ErrorMaps, ErrorTerm
    from ..uncertainty.ledger import LeftOut
    from .accuracy_knobs import AccuracyKnob, ErrorShare

    Numbers: TypeAlias = npt.NDArray[np.floating[Any]]


# --- kinds: required members of every component ---------------------------------------------------


@runtime_checkable
class Scene(Protocol):
    """The scene in front of the camera: geometry, materials and lamps, or the light itself."""

    def __call__(self) -> SceneDescription | xr.Dataset:
        """Return the description for a renderer, or scene radiance if it is known without one.

        Returns
        -------
        `isethdr_core.scene.SceneDescription`, or a Dataset with the variable `radiance
        (light_group, wavelength, y, x)` in W m-2 sr-1 nm-1.
        """


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
class Lighting(Protocol):
    """Mixes the light groups of a scene."""

    def __call__(self, radiance: xr.Dataset, /) -> xr.DataArray:
        """Return mixed radiance, with the weights used in the attribute `weights` {group: weight}.

        Parameters
        ----------
        radiance : scene radiance, `radiance (light_group, wavelength, y, x)` in W m-2 sr-1 nm-1.

        Returns
        -------
        DataArray `([component,] wavelength, y, x)`, W m-2 sr-1 nm-1.
        """


@runtime_checkable
class Lens(Protocol):
    """Images mixed radiance onto the sensor plane."""

    def __call__(self, mixed: xr.DataArray, /, *, flares: Sequence[Flare] = ()) -> xr.DataArray:
        """Return irradiance on the sensor plane.

        Parameters
        ----------
        mixed : `([component,] wavelength, y, x)` in W m-2 sr-1 nm-1; x and y as the attribute
            `projection` states: tangents of the field angle, or radians.
        flares : any number, in any order.

        Returns
        -------
        DataArray `([component,] wavelength, y, x)`, W m-2 nm-1; x and y in metres.
        """


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
class Isp(Protocol):
    """Image signal processing: makes a picture of captures."""

    def __call__(self, captures: xr.Dataset, /) -> xr.Dataset:
        """Return the picture.

        Parameters
        ----------
        captures : captures of one shot, `raw (capture, y, x)` in DN.

        Returns
        -------
        Dataset with `xyz (y, x, xyz_channel)`, Y in cd/m2, `variance` in (cd/m2)^2, and
        `valid (y, x)`.
        """


@runtime_checkable
class Metric(Protocol):
    """Scores a picture."""

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None, /
    ) -> list[Score]:
        """Return scores.

        Parameters
        ----------
        picture, truth : with and without the camera's errors, on one grid of pixels.
        labels : the labels that `narrow` asks for, per pixel; None without labels.
        """


@runtime_checkable
class TransmitsPupil(Protocol):
    """A flare that changes the light in the pupil."""

    def pupil(self, x_mm: Numbers, y_mm: Numbers, wavelength_nm: float, /) -> Numbers:
        """Return the complex transmission of the amplitude; its modulus is at most 1.

        Parameters
        ----------
        x_mm, y_mm : places in the pupil, mm, 0 on the axis, arrays of one shape.
        wavelength_nm : wavelength of the light, nm.

        Returns
        -------
        Complex numbers of the shape of `x_mm`.
        """


@runtime_checkable
class ScattersLight(Protocol):
    """A flare that scatters light by an angle."""

    def scatter(self, wavelength_nm: float, angle_rad: Numbers, /) -> Numbers:
        """Return the share of the light that is scattered, per steradian.

        Its integral over the hemisphere is at most 1.

        Parameters
        ----------
        wavelength_nm : wavelength of the light, nm.
        angle_rad : between the scattered ray and the straight one, rad.

        Returns
        -------
        Numbers of 0 or more, 1/sr, of the shape of `angle_rad`.
        """


@runtime_checkable
class AddsLight(Protocol):
    """A flare that adds light to the image, such as ghosts."""

    def irradiance(self, lens: Lens, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return the irradiance that comes on top of the image, linear in `mixed`.

        Parameters
        ----------
        lens : lens that images the scene.
        mixed : mixed radiance, as for the call of the lens.

        Returns
        -------
        DataArray `(wavelength, y, x)`, W m-2 nm-1, on the grid of the lens's own answer.
        """


@runtime_checkable
class RedirectsLight(Protocol):
    """A flare in front of the lens that turns light elsewhere, such as drops on a windscreen."""

    def redirected(self, lens: Lens, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return the mixed radiance that reaches the lens, linear in `mixed`.

        Even light of the whole field becomes no brighter.

        Parameters
        ----------
        lens : lens that images the scene.
        mixed : mixed radiance `([component,] wavelength, y, x)`.

        Returns
        -------
        Mixed radiance with the dims, coordinates and attributes of `mixed`.
        """


# a flare has at least one of these
Flare: TypeAlias = TransmitsPupil | ScattersLight | AddsLight | RedirectsLight


# --- abilities of any kind ------------------------------------------------------------------------


@runtime_checkable
class NarrowsDemand(Protocol):
    """A component that does not need all that later stages would let it have."""

    def narrow(self, demand: Demand, /) -> Demand:
        """Return a smaller demand. The dropped part must not matter to the component.

        The dropped part is stated with `ledger.left_out`.
        """


@runtime_checkable
class ReadsFiles(Protocol):
    """A component whose result depends on the content of files."""

    def input_files(self) -> Iterable[str | PathLike[str]]:
        """Return the paths of those files; their content is part of a run's name."""


@runtime_checkable
class RunsPrograms(Protocol):
    """A component whose result depends on programs that it starts."""

    def programs(self) -> dict[str, str]:
        """Return {program: version} of those in use; they are part of a run's name."""
        ...


@runtime_checkable
class ChoosesKernels(Protocol):
    """A component whose library compiles or picks code for the processor."""

    def kernels(self) -> dict[str, str]:
        """Return {library: its selection in this process} for the libraries in use."""
        ...


@runtime_checkable
class DeclaresAccuracy(Protocol):
    """A component with fields that trade accuracy for time."""

    accuracy_knobs: ClassVar[Sequence[AccuracyKnob]]  # a study varies them, a budget may set them


@runtime_checkable
class DividesErrorAllowed(Protocol):
    """A lens that itself divides the error allowed among its approximations."""

    error_shares: ClassVar[Sequence[ErrorShare]]  # their costs; the lens receives the sum


# --- abilities of scenes and renderers ------------------------------------------------------------


@runtime_checkable
class KnowsItsBands(Protocol):
    """A scene or renderer that knows its bands before it makes any light."""

    def bands_nm(self) -> Iterable[float]:
        """Return the centres of all bands that it would make, nm, ascending."""


@runtime_checkable
class CountsTiles(Protocol):
    """A scene or renderer that knows the size of its frame."""

    def tile_counts(self, margin: bool) -> tuple[int, int]:
        """Return (rows, columns) of tiles, with those beyond the camera's field if `margin`."""
        ...


@runtime_checkable
class KnowsItsField(Protocol):
    """A scene that knows the camera's field."""

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the field: tangents, or radians if equidistant."""
        ...


@runtime_checkable
class ListsGroups(Protocol):
    """A scene that knows its light groups before its radiance is computed."""

    def light_groups(self) -> tuple[str, ...]:
        """Return the names of the light groups of the scene.

        A lighting that names another group is an error.
        """
        ...


@runtime_checkable
class ChecksFiles(Protocol):
    """A scene that can check its files without reading their light."""

    def check_files(self) -> None:
        """Raise CatalogError or UnitError where a file of the scene cannot be right."""


@runtime_checkable
class MovesInTime(Protocol):
    """A scene whose things may move: fields of the dataclass say when it is seen.

    The core makes the scene of another moment with `dataclasses.replace`.
    """

    @property
    def time_s(self) -> float:
        """Time for which everything has moved on, s."""
        ...

    @property
    def frames_per_s(self) -> float | None:
        """Frames per second; the scene then states `SceneDescription.next_frame`, or its radiance
        has the label `motion`. None: it states neither.
        """
        ...


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
    """A renderer that states whether it can render a scene with fog. Others are refused there."""

    RENDERS_FOG: ClassVar[bool]  # True: `SceneDescription.fog` is rendered


@runtime_checkable
class NamesItsEffort(Protocol):
    """A renderer with fields that buy accuracy and do not change the answer."""

    effort_fields: ClassVar[Sequence[str]]  # their names; a store that spent more serves as well


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
class EstimatesRendering(Protocol):
    """A renderer that can estimate the time for a frame without stored radiance."""

    def rendering_s(self, frame: Frame, groups: int | None, /) -> float | None:
        """Return seconds; None without an estimate.

        Parameters
        ----------
        frame : tiles and bands that will be rendered.
        groups : number of light groups; None if it is not known yet.
        """
        ...


@runtime_checkable
class CountsRenderMemory(Protocol):
    """A renderer that knows about how much memory it takes."""

    def memory_bytes(self, frame: Frame, /) -> float:
        """Return the bytes that rendering a frame takes, the scene included.

        Parameters
        ----------
        frame : tiles and bands that will be rendered.
        """
        ...


@runtime_checkable
class EstimatesSamples(Protocol):
    """A renderer that can estimate its number of samples."""

    def expected_paths(self, paths: int, noise: float | None, /) -> float:
        """Return the samples per tile that a light group will take.

        Parameters
        ----------
        paths : samples per tile of an earlier rendering.
        noise : relative noise of these samples.
        """
        ...


# --- abilities of lightings -----------------------------------------------------------------------


@runtime_checkable
class LooksWithinField(Protocol):
    """A lighting that states whether tiles beyond the camera's field change its weights."""

    WITHIN_FIELD: ClassVar[bool]  # True: they do not


@runtime_checkable
class ChecksGroups(Protocol):
    """A lighting that names light groups."""

    def check_groups(self, groups: Sequence[str], /) -> None:
        """Raise ConfigError where the lighting needs a group that is not among `groups`."""


# --- abilities of lenses --------------------------------------------------------------------------


@runtime_checkable
class KnowsImageSize(Protocol):
    """A lens that knows the size of its image."""

    def image_size_m(self, width: float, height: float, projection: str, /) -> tuple[float, float]:
        """Return (width, height) in metres of the image of a field, the largest rectangle in it.

        Parameters
        ----------
        width, height : size of the field, in the unit of the projection: tangents, or radians.
        projection : "tangent" or "equidistant".
        """
        ...


@runtime_checkable
class StatesFieldBorder(Protocol):
    """A lens that loses light at the border of a field."""

    def state_field(self, width: float, height: float, projection: str, /) -> None:
        """State in the ledger how light at the border of the camera's field is treated.

        Parameters
        ----------
        width, height : size of the field, in the unit of the projection: tangents, or radians.
        projection : "tangent" or "equidistant".
        """


@runtime_checkable
class FocusesAtDepth(Protocol):
    """A lens that may blur what is out of focus, by the label `depth` of the radiance."""

    def in_focus(self) -> Lens:
        """Return the lens that has all depths in focus; the lens itself where it always has."""
        ...


@runtime_checkable
class KeepsLight(Protocol):
    """A lens that can keep the light of every tile within the tile.

    It needs no light from beyond the camera's field. A lens that outlines its plan states this
    there (`OutlinesImaging`) instead.
    """

    def keeps_light(self, flares: Sequence[Flare], /) -> bool:
        """Return whether the lens has no blur, no flare and no distortion."""
        ...


@runtime_checkable
class CountsMemory(Protocol):
    """A lens that knows the memory for a frame, and refuses frames that it cannot compute."""

    def held_bytes(self, frame: Frame, flares: Sequence[Flare], /) -> Mapping[str, float]:
        """Return {description: bytes} of all arrays that are held at the same time in addition to
        the light.

        The descriptions are for messages, in the plural: "ray tables".
        """
        ...


@runtime_checkable
class CountsKernels(Protocol):
    """Earlier form of `CountsMemory`, one number; accepted until version 1.0."""

    def kernel_bytes(self, frame: Frame, flares: Sequence[Flare], /) -> float:
        """Return the bytes that the lens holds for a frame beside the light."""
        ...


@runtime_checkable
class EstimatesImaging(Protocol):
    """A lens that can estimate the time for the light of a frame."""

    def expected_s(self, frame: Frame, flares: Sequence[Flare], /) -> float | None:
        """Return seconds, given the kept results of earlier runs; None without an estimate."""
        ...


class ImagingPlan(Protocol):
    """How a lens images one field; `PlansImaging` returns it."""

    @property
    def terms(self) -> Sequence[ErrorTerm]:
        """The errors that are known before imaging."""
        ...

    @property
    def left_out(self) -> Sequence[LeftOut]:
        """The omissions, each with a bound on its effect."""
        ...

    def image(self, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return irradiance or photocurrent of mixed radiance on the planned field."""
        ...

    def light_errors(self, mixed: xr.DataArray, weights: Numbers, /) -> ErrorMaps | None:
        """Return the errors of the light of `mixed`, tile by tile, (channel, y, x).

        Parameters
        ----------
        weights : (channel, band), weights of the irradiance of each band of `mixed`.

        Returns
        -------
        One tile per tile of the light that `image` makes; None if the errors are not known.
        """
        ...


@runtime_checkable
class PlansImaging(Protocol):
    """A lens that decides once which parts of a field, and of its own effects, are needed."""

    def plan(
        self,
        flares: Sequence[Flare],
        field: xr.DataArray,
        response: Response | None,
        budget: LightBudget,
        /,
    ) -> ImagingPlan:
        """Return the plan of imaging a field.

        Parameters
        ----------
        flares : flare models in the lens.
        field : mixed radiance `([component,] wavelength, y, x)`.
        response : response of all sensors; None if one of them needs light wavelength by
            wavelength.
        budget : the part of the light that is needed, and the error allowed.
        """
        ...


@runtime_checkable
class OutlinesImaging(Protocol):
    """A lens whose plan is partly known before there is any light."""

    def outline(
        self, flares: Sequence[Flare], ahead: FieldAhead, budget: LightBudget, /
    ) -> ImagingOutline:
        """Return the inputs that the plan will need, and its certain omissions.

        The lens has to plan its imaging too (`PlansImaging`): otherwise nothing may be left out.

        Parameters
        ----------
        flares : flare models in the lens.
        budget : the part of the light that is needed, and the error allowed; its `sensed_nm` is
            None if it is not known.
        ahead : the known properties of the field.
        """
        ...


@runtime_checkable
class MakesPhotocurrent(Protocol):
    """A lens that can answer with the photocurrent of one sensor instead of irradiance."""

    def photocurrent(
        self, mixed: xr.DataArray, flares: Sequence[Flare], response: Response, /
    ) -> xr.DataArray:
        """Return photocurrent in the window of the sensor, or irradiance where that is cheaper.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        response : response of all sensors; its `noise_fraction_allowed` is the error allowed.

        Returns
        -------
        DataArray `([component,] channel, y, x)`, electrons m-2 s-1, or irradiance.
        """
        ...


@runtime_checkable
class StatesErrors(Protocol):
    """A lens that knows the errors of its light, tile by tile."""

    def light_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: Numbers,
        response: Response | None,
        /,
    ) -> ErrorMaps | tuple[Numbers, Numbers] | None:
        """Return the errors of the light, tile by tile.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        response : response of all sensors; None for irradiance.
        weights : (channel, band), weights of the irradiance of each band.

        Returns
        -------
        Standard deviation and bound, each (channel, y, x), in the unit of irradiance times
        `weights`; None if they are not known. A tuple is accepted until version 1.0.
        """
        ...


@runtime_checkable
class StatesSpreadErrors(Protocol):
    """Earlier form of `StatesErrors`, under another name; accepted until version 1.0."""

    def spread_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: Numbers,
        response: Response | None,
        /,
    ) -> ErrorMaps | tuple[Numbers, Numbers] | None:
        """Return the errors of the light, tile by tile.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        weights : (channel, band), weights of the irradiance of each band.
        response : response of all sensors; None for irradiance.
        """
        ...


@runtime_checkable
class HasPointSpread(Protocol):
    """A lens that shows its point spread function on the axis.

    For people and the conformance kit: no stage of a run asks for it.
    """

    def psf(self, wavelength_nm: Sequence[float], pitch_um: float, size: int) -> xr.DataArray:
        """Return the share of the light on each sample, (wavelength, y, x), at most 1 in sum.

        Parameters
        ----------
        wavelength_nm : wavelengths, nm.
        pitch_um : between samples, um.
        size : samples along each side; the axis is at index size // 2.
        """
        ...


# --- abilities of sensors -------------------------------------------------------------------------


@runtime_checkable
class DeclaresNoise(Protocol):
    """A sensor that states whether its shots differ."""

    @property
    def noise(self) -> bool:
        """False: every noise realisation is the same, so one is enough."""
        ...


@runtime_checkable
class HasPixelPitch(Protocol):
    """A sensor with a pixel pitch; the conformance kit makes light of that size."""

    @property
    def pitch_um(self) -> float:
        """Distance between pixel centres, um."""
        ...


@runtime_checkable
class HasPixelCounts(Protocol):
    """A sensor whose numbers of pixels are fields."""

    @property
    def rows(self) -> int | None:
        """Return the number of pixel rows; None where they fill the field."""
        ...

    @property
    def columns(self) -> int | None:
        """Return the number of pixel columns; None where they fill the field."""
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
    """A sensor whose automatic exposure may follow the light late, in a sequence of frames."""

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


# --- abilities of image signal processing ---------------------------------------------------------


@runtime_checkable
class ChecksCaptures(Protocol):
    """Image signal processing that depends on the names of captures or on the filter array."""

    def check_shot(self, form: ShotForm, /) -> None:
        """Raise ConfigError where captures of this form cannot be processed."""


# --- abilities of metrics -------------------------------------------------------------------------


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
        """Return the scores of a further noise realisation; only their values count.

        Parameters
        ----------
        picture : the further realisation.
        first : the first realisation on the same grid, which the metric has scored in full.
        truth : reference picture of both.
        labels : the labels that `narrow` asks for, per pixel; None without labels.
        """


@runtime_checkable
class HasMeanOfParts(Protocol):
    """A metric that states whether its score is nearly the mean of the scores of parts."""

    MEAN_OF_PARTS: ClassVar[bool]  # True: it is, and needs no labels


@runtime_checkable
class ScoresParts(Protocol):
    """A metric with `MEAN_OF_PARTS` that scores all parts of a picture in one pass."""

    def of_parts(
        self, picture: xr.Dataset, truth: xr.Dataset, part: np.ndarray, /
    ) -> list[list[Score]]:
        """Return the scores of the frame for each of its parts; only their values count.

        Parameters
        ----------
        picture, truth : with and without the camera's errors, on one grid of pixels.
        part : (y, x), number of the part of each pixel, from 0.
        """


@runtime_checkable
class HasWhite(Protocol):
    """A metric that compares pictures against the display white of the whole reference picture
    (`display_view.white_cd_m2`), unless its field `white_cd_m2` is above 0.
    """

    WHITE_SCORE: ClassVar[str]  # name of its score that is the white it took, in cd/m2

    @property
    def white_cd_m2(self) -> float:
        """The white to take; 0: that of the reference picture."""
        ...


# --- abilities of each kind -----------------------------------------------------------------------

REQUIRED: dict[str, type] = {  # a flare has at least one of `FLARES` instead
    "scene": Scene,
    "renderer": Renderer,
    "lighting": Lighting,
    "lens": Lens,
    "sensor": Sensor,
    "isp": Isp,
    "metric": Metric,
}
FLARES: tuple[type, ...] = (TransmitsPupil, ScattersLight, AddsLight, RedirectsLight)
OF_ANY_KIND: tuple[type, ...] = (
    NarrowsDemand,
    ReadsFiles,
    RunsPrograms,
    ChoosesKernels,
    DeclaresAccuracy,
    DividesErrorAllowed,  # refused where the kind is no lens
)
# forms of earlier versions, until version 1.0
EARLIER: tuple[type, ...] = (CountsKernels, StatesSpreadErrors)
OPTIONAL: dict[str, tuple[type, ...]] = {
    "scene": (KnowsItsBands, CountsTiles, KnowsItsField, ListsGroups, ChecksFiles, MovesInTime),
    "renderer": (
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
    ),
    "lighting": (LooksWithinField, ChecksGroups),
    "lens": (
        KnowsImageSize,
        StatesFieldBorder,
        KeepsLight,
        CountsMemory,
        CountsKernels,
        EstimatesImaging,
        PlansImaging,
        OutlinesImaging,
        MakesPhotocurrent,
        StatesErrors,
        StatesSpreadErrors,
        HasPointSpread,
    ),
    "flare": FLARES,
    "sensor": (
        DeclaresNoise,
        HasPixelPitch,
        HasPixelCounts,
        ChecksImageSize,
        ChecksFocalLength,
        TimesItsShot,
        CarriesExposure,
        CountsPixels,
        ListsCaptures,
    ),
    "isp": (ChecksCaptures,),
    "metric": (HasMeanOfParts, HasWhite, ScoresFurther, ScoresParts),
}


def required_of(kind: str) -> tuple[type, ...]:
    """Return the Protocols that every component of a kind follows."""
    return (REQUIRED[kind],) if kind in REQUIRED else ()


def abilities_of(kind: str) -> tuple[type, ...]:
    """Return the Protocols of all abilities that a component of a kind may offer."""
    return (*OPTIONAL[kind], *OF_ANY_KIND)
