"""The renderer `mitsuba`: from scene description and demand to scene radiance and labels."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np

from isethdr_core import ledger
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.pipeline.runtime_estimate.machine_speed import relative_speed
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, Cost
from isethdr_core.plugins.ranges import Range, Seed, Wavelength, check_ranges
from isethdr_core.runs.processor import processors
from isethdr_core.uncertainty.error_terms import Quantity

from .bands import check_bands
from .doctor import choose_variant
from .frame import LARGEST_SAMPLES, Request, render_frame
from .world.view import check_square

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.memory import Frame
    from isethdr_core.runs.sample_accumulation import Known
    from isethdr_core.scene import SceneDescription

# Defaults if neither `samples` nor `error_allowed` is set: noise as a share of the cameras' noise,
# and, without cameras, relative noise of a light group
NOISE_SHARE = 0.8
ERROR_ALLOWED = 0.1
LEAST_SAMPLES = 16  # smallest number of samples per tile from which noise can be estimated
SCALAR = "scalar_spectral"
# Run time of a night drive: CPU time of a tile, us, for the pilot pass and for further paths, and
# seconds for compiling and for the tables of the scene. All are those of a processor whose
# `relative_speed` is 1. Two machines of two cores needed 630 and 930 us and 25 and 80 s. Stored
# renderings correct the estimate (isethdr_core.pipeline.runtime_estimate).
PILOT_US = 190.0
NEED_US = 610.0  # with a share of `NEED_SHARE`
NEED_SHARE = 0.6
WORLD_S = 50.0
# Memory of meshes, tables and compiled code: 0.16 to 0.9 GB in ledgers of streets and night drives
RENDERING_BYTES = 5e8
# Memory of the light, from peaks of 0.4 and 1.7 GB for 96 x 54 and 480 x 270 tiles of 61 bands and
# four groups: for each value, two half buffers, their mean, the light with visible lamps, and the
# picture; for each tile and group, sums and noise; for each value of a launch, its results
VALUE_BYTES = 28
TILE_BYTES = 400
LAUNCH_BYTES = 12
LAUNCH_TILES = 1 << 17
FEW_GROUPS = 4  # number of light groups of the bundled scenes
MOST_GROUPS = 32  # largest number of light groups of compiled code, one bit each
# Run time of a path for one group and four bands, s, measured on two cores; it only tells the user
# what to expect
SCALAR_S_PER_PATH = {"tangent": 2e-6, "equidistant": 1e-5}

Tiles = Annotated[int, Range(1, 10_000)]  # along one side; the limit is beyond an 8K camera
Margin = Annotated[float, Range(0, 2)]  # share of the field; 2 makes the frame five fields wide
BandStep = Annotated[float, Range(0.1, 3000)]  # nm
Samples = Annotated[int, Range(1, LARGEST_SAMPLES)]
ErrorAllowed = Annotated[float, Range(1e-5, 0.999)]
NoiseShare = Annotated[float, Range(0.01, 100.0)]
Depth = Annotated[int, Range(1, 1000)]  # segments; hardly any light is left after a few dozen

OTHER_PATHS = {"seed": 2**40 + 1}  # seed for a reference with independent noise
# Noise falls with the square root of the number of paths. Costs of depth and bands are fits to CPU
# seconds of a night drive (160 x 90 tiles, 64 paths): 7.6, 9.5, 11.9, 13.2 and 15.7 s for 2, 4, 5,
# 8 and 16 segments, because many paths end early; 10.7 and 12.5 s for 50 and 5 nm, because a path
# carries all bands.
ACCURACY_KNOBS = (
    AccuracyKnob(
        "samples",
        (16, 64, 256),
        Quantity.RADIANCE,
        Cost(1.0, -1.0),
        reference=1024,
        independent=OTHER_PATHS,
        matters=lambda renderer: renderer.error_allowed is None,
    ),
    AccuracyKnob(
        "error_allowed",
        (0.4, 0.2, 0.1),
        Quantity.RADIANCE,
        Cost(1.0, 2.0),
        reference=0.05,
        independent=OTHER_PATHS,
        budgeted=True,
        matters=lambda renderer: renderer.samples is None,
    ),
    AccuracyKnob(
        "noise_share_allowed",
        (1.6, 0.8, 0.4),
        Quantity.RADIANCE,
        lambda share: PILOT_US + NEED_US * (NEED_SHARE / share) ** 2,
        reference=0.2,
        independent=OTHER_PATHS,
        matters=lambda renderer: renderer.limit_share() is not None,
    ),
    AccuracyKnob(
        "max_depth",
        (2, 3, 4, 5, 8),
        Quantity.RADIANCE,
        Cost(1.0, -0.5),
        reference=16,  # with the same paths: noise of other paths would hide the missing light
    ),
    AccuracyKnob(
        "step_nm", (50.0, 30.0, 20.0, 10.0), Quantity.ELECTRONS, Cost(1.0, 0.06), reference=5.0
    ),
)


@dataclass(frozen=True)
class MitsubaRenderer:
    """Path tracing with Mitsuba 3, with exact labels and small lamps.

    Compiled variants render all bands and light groups in one pass. The variant `scalar` renders
    four bands of one light group at a time.
    """

    THREAD_SAFE: ClassVar[bool] = True
    # fields that change only the accuracy, and are no part of a recipe
    effort_fields: ClassVar[tuple[str, ...]] = (
        "samples",
        "error_allowed",
        "most_samples",
        "most_mean_samples",
        "noise_share_allowed",
    )

    width: Tiles = 640  # tiles across the camera's field
    height: Tiles = 360  # tiles down the camera's field
    # overscan on each side of the field, as a share of the field; compiled variants leave it out if
    # neither the lens nor a lighting needs it
    margin: Margin = 0.1
    first_nm: Wavelength = 400.0  # centre of the first band
    last_nm: Wavelength = 700.0  # centre of the last band
    step_nm: BandStep = 10.0  # width and spacing of the bands
    # samples per tile; with error_allowed the smallest number; null takes as many as the allowed
    # noise needs, at least 16
    samples: Samples | None = None
    # allowed noise of the light as a share of the noise of the cameras, if neither samples nor
    # error_allowed is set; null and the variant scalar limit the noise of each light group to 0.1
    # instead
    noise_share_allowed: NoiseShare | None = NOISE_SHARE
    # allowed relative noise of each light group; null: no limit if `samples` is set; otherwise
    # noise_share_allowed if all cameras have noise, else 0.1
    error_allowed: ErrorAllowed | None = None
    most_samples: Samples = 4096  # largest number of samples per tile, unless `samples` is larger
    # largest mean number of samples per tile, all light groups together, where the cameras limit
    # the noise. If more would be needed, the allowed noise of all tiles is raised by one factor.
    # The first 16 samples of each group are always taken. null: no limit; not used by the variant
    # scalar
    most_mean_samples: Samples | None = None
    max_depth: Depth = 5  # longest light path in segments; 2 is direct light only
    seed: Seed = 0  # seed of the samples; the same seed gives the same radiance on the same machine
    # Mitsuba variant; auto takes the first of cuda, llvm and scalar that works
    variant: Literal["auto", "llvm", "cuda", "scalar"] = "auto"
    # for lamps with a cone (inner_deg, outer_deg): quantity that a narrower cone keeps, candela on
    # the axis or lumens. Lamps with a table and Lambertian lamps do not depend on it; all lamps of
    # the bundled scenes are of these two kinds
    normalise: Literal["intensity", "flux"] = "intensity"

    accuracy_knobs: ClassVar[tuple[AccuracyKnob, ...]] = ACCURACY_KNOBS
    RENDERS_FOG: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.first_nm > self.last_nm:
            raise ConfigError(
                f"renderer bands {self.first_nm:g} to {self.last_nm:g} nm; expected "
                "first_nm <= last_nm; type renderer.first_nm=400 renderer.last_nm=700"
            )

    def enough(self, paths: int, noise: float | None) -> bool:
        """Return whether a light group needs no more samples.

        Parameters
        ----------
        paths : samples per tile so far.
        noise : relative noise of their mean; None: no light.
        """
        settings = self.decided()
        if settings.error_allowed is None or paths < 2:  # the noise of one path is unknown
            return settings.error_allowed is None and paths >= settings.samples
        return paths >= settings.samples and (
            noise is None or noise <= settings.error_allowed or paths >= settings.most_samples
        )

    def expected_paths(self, paths: int, noise: float | None) -> int:
        """Return the estimated number of paths per tile of a light group. Noise falls with the
        square root of the number of paths.

        Parameters
        ----------
        paths : samples per tile of an earlier rendering.
        noise : relative noise of their mean; None: no light.
        """
        if self.limit_share() is not None:  # the need of cameras depends mostly on the scene
            return max(paths, LEAST_SAMPLES)
        settings = self.decided()
        if settings.error_allowed is None or noise is None:
            return settings.samples
        return int(
            min(
                max(paths * (noise / settings.error_allowed) ** 2, settings.samples),
                max(settings.most_samples, settings.samples),
            )
        )

    def rendering_s(self, frame: Frame, groups: int | None) -> float | None:
        """Return the estimated run time, s, of a frame without stored samples, from that of a night
        drive. Return None if the settings fix samples or the noise of light groups, or if the
        variant is set to scalar.

        Parameters
        ----------
        frame : size and bands of the frame.
        groups : number of light groups. It is not used: the constants were measured with the
            groups of a night drive together, and tell nothing of the share of one group.
        """
        share = self.limit_share()
        if share is None or self.variant == "scalar":
            return None
        us = PILOT_US + NEED_US * (NEED_SHARE / share) ** 2
        seconds = WORLD_S + 1e-6 * us * frame.rows * frame.columns / processors()
        return seconds / relative_speed()

    def memory_bytes(self, frame: Frame) -> float:
        """Return the estimated peak memory of a rendering of a few light groups, bytes."""
        tiles = FEW_GROUPS * frame.rows * frame.columns
        bands = len(frame.wavelength_nm)
        launch = min(tiles, FEW_GROUPS * LAUNCH_TILES) * bands
        light = VALUE_BYTES * bands * tiles + TILE_BYTES * tiles + LAUNCH_BYTES * launch
        return RENDERING_BYTES + light

    def limit_share(self) -> float | None:
        """Return the allowed noise of the light as a share of the cameras' noise; None if samples
        or the noise of light groups limit it instead.
        """
        if self.samples is not None or self.error_allowed is not None:
            return None
        return self.noise_share_allowed

    def decided(self) -> MitsubaRenderer:
        """Return the renderer with `samples` and `error_allowed` set to their defaults, if
        `samples` is None.
        """
        if self.samples is not None:
            return self
        return replace(
            self,
            samples=LEAST_SAMPLES,
            error_allowed=ERROR_ALLOWED if self.error_allowed is None else self.error_allowed,
        )

    def kernels(self) -> dict[str, str]:
        """Return {"mitsuba": variant of this process and its compiler}; an empty dict if Mitsuba
        was not used.
        """
        mitsuba = sys.modules.get("mitsuba")
        variant = mitsuba.variant() if mitsuba else None
        if not variant:
            return {}
        if not variant.startswith("llvm"):
            return {"mitsuba": variant}
        import drjit

        return {"mitsuba": f"{variant}, LLVM {'.'.join(map(str, drjit.detail.llvm_version()))}"}

    def __call__(
        self,
        description: SceneDescription,
        demand: Demand | None = None,
        known: dict[str, Known] | None = None,
    ) -> xr.Dataset:
        """Return the scene radiance with the light groups, bands and labels of a demand.

        Parameters
        ----------
        description : the scene.
        demand : light groups, bands, labels and accuracy; None: all groups and bands.
        known : {light group: samples and noise of earlier renderings}. Only missing samples are
            computed, and the result consists of these alone.

        Raises
        ------
        ConfigError : the scene is incomplete, or the demand or a setting does not fit it.
        """
        check_models(description)
        groups = self._groups(description, demand)
        bands = self._bands(demand)
        check_bands(description, groups, bands)
        variant = choose_variant(self.variant)
        if variant == SCALAR:
            self._say_how_slow(len(groups), len(bands), description.camera.projection)
        elif len(groups) > MOST_GROUPS:
            raise ConfigError(
                f"{len(groups)} light groups of scene {description.name!r} are requested; renderer"
                f" mitsuba renders at most {MOST_GROUPS} together; give lamps that always shine"
                " together the same group, or request fewer groups"
            )
        request = Request(groups, bands, demand or Demand(), known)
        return render_frame(self, description, request, variant)

    def _say_how_slow(self, groups: int, bands: int, projection: str) -> None:
        tiles = self.width * self.height * (1 + 2 * self.margin) ** 2
        asked = self.decided()
        minutes = (
            SCALAR_S_PER_PATH.get(projection, 0)
            * asked.samples
            * tiles
            * groups
            * -(-bands // 4)
            / 60
        )
        if minutes > 5:
            about = "about" if asked.error_allowed is None else "at least"
            used = "without LLVM 17 or newer the scalar variant is used, which takes"
            instead = "`isethdr doctor` says what to install"
            if self.variant == "scalar":  # chosen, whatever else works
                used = "the scalar variant takes"
                instead = "renderer.variant=auto takes a faster one where it works"
            print(
                f"renderer: {used} {about} {minutes:.0f} minutes here and is one to five times as"
                f" noisy; {instead}; or take a first look with renderer=mitsuba_quick",
                file=sys.stderr,
                flush=True,
            )

    def _groups(self, description: SceneDescription, demand: Demand | None) -> list[str]:
        groups_of_scene = description.light_groups()
        if not groups_of_scene:
            raise ConfigError(
                f"scene {description.name!r} has no light: no lamp and no sky; "
                "expected at least one emitter, for example sky=isethdr_core.scene.flat(1e-6)"
            )
        requested = (
            groups_of_scene if demand is None or demand.groups is None else tuple(demand.groups)
        )
        for name in sorted(set(requested) - set(groups_of_scene)):
            ledger.left_out(
                f"light group {name}",
                f"scene {description.name!r} has no such emitter",
                0.0,
                "cd/m2",
            )
        chosen = [g for g in groups_of_scene if g in requested]
        if not chosen:
            raise ConfigError(
                f"no light group of scene {description.name!r} is requested; requested"
                f" {', '.join(requested) or 'none'}"
                + did_you_mean(requested[0] if requested else "", groups_of_scene)
            )
        for name in sorted(set(groups_of_scene) - set(chosen)):
            ledger.left_out(f"light group {name}", "not demanded", 0.0, "cd/m2", needless=True)
        return chosen

    def check_field(self, width: float, height: float, projection: str) -> None:
        """Refuse, before rendering, numbers of tiles that do not fit a camera's field.

        Parameters
        ----------
        width : width of the field, in the unit of the projection.
        height : height of the field, in the unit of the projection.
        projection : `tangent` or `equidistant`.

        Raises
        ------
        ConfigError : the variant is set to scalar, and the tiles would not be square.
        """
        if self.variant == "scalar" and projection == "tangent":
            check_square(self.width, self.height, width / height)

    def tile_counts(self, margin: bool) -> tuple[int, int]:
        """Return (rows, columns) of tiles; with `margin`, also those beyond the camera's field."""
        rows, columns = (n + 2 * round(n * self.margin * margin) for n in (self.height, self.width))
        return rows, columns

    def bands_nm(self) -> tuple[float, ...]:
        """Return the centres of all bands, nm."""
        return tuple(map(float, self._bands(None)))

    def _bands(self, demand: Demand | None) -> np.ndarray:
        bands = self.first_nm + self.step_nm * np.arange(
            int((self.last_nm - self.first_nm) / self.step_nm + 1 + 1e-9)
        )
        if demand is None or demand.wavelength_nm is None:
            return bands
        # a demanded wavelength needs the bands on both sides of it, for interpolation
        requested_nm = np.asarray(demand.wavelength_nm, float)
        matches = np.abs(bands[:, None] - requested_nm) < self.step_nm * (1 - 1e-9)
        chosen = bands[matches.any(1)]
        if not len(chosen):
            raise ConfigError(
                f"no band between {bands[0]:g} and {bands[-1]:g} nm is requested; requested"
                f" {np.array2string(requested_nm, threshold=8)} nm"
            )
        if len(chosen) < len(bands):
            ledger.left_out(
                f"{len(bands) - len(chosen)} of {len(bands)} bands",
                "wavelengths not demanded",
                0.0,
                "W m-2 sr-1 nm-1",
                key="bands",
                needless=True,
            )
        return chosen


def check_models(description: SceneDescription) -> None:
    """Raise ConfigError if an object has a model that the scene lacks."""
    for placed in description.objects:
        if placed.model not in description.models:
            raise ConfigError(
                f"object {placed.name!r} has the unknown model {placed.model!r}"
                + did_you_mean(placed.model, description.models)
            )
