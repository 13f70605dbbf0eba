"""Bad input: every wrong value here must be refused, with the expected class of error."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_mitsuba.world.view import nearest_square
from scipy.io import savemat

from isethdr_core import compose, generator
from isethdr_core.errors import CatalogError, ConfigError, UnitError
from isethdr_core.pipeline.chain import chain
from isethdr_core.plugins.registry import build

from .inputs import irradiance, mixed
from .verdict import Measured

if TYPE_CHECKING:
    from isethdr_core.pipeline.chain import Chain
    from isethdr_core.runs.seeds import Generator

FIELDS = (
    ("scene", "uniform", {"first_nm": 0.4, "last_nm": 0.7}),  # micrometres
    ("scene", "uniform", {"first_nm": 4e-7, "last_nm": 7e-7}),  # metres
    ("scene", "uniform", {"first_nm": 900.0, "last_nm": 1000.0}),  # invisible: no luminance
    ("scene", "night_drive", {"seed": -1}),
    ("scene", "night_drive", {"seed": 1.7}),
    ("scene", "night_drive", {"people": (3, 2)}),
    ("renderer", "mitsuba", {"last_nm": 7e-7}),
    ("renderer", "mitsuba", {"error_allowed": math.nan}),
    ("lighting", "weights", {"weights": {"sky": math.inf}}),
    ("lens", "wavefront", {"zernike_um": {4: math.nan}}),
    ("lens", "wavefront", {"zernike_um": {4: math.inf}}),
    ("lens", "wavefront", {"zernike_um": {4: True}}),
    ("lens", "wavefront", {"field_zernike_um": {0.0: {4: math.nan}, 20.0: {}}}),
    ("lens", "wavefront", {"error_allowed": math.inf}),
    ("lens", "ideal", {"f_number": math.nan}),
    ("lens", "ideal", {"f_number": -4.0}),
    ("lens", "ideal", {"distortion": {"model": "brown_conrady", "k1": math.nan}}),
    ("lens", "ideal", {"distortion": {"model": "kannala_brandt", "k1": 1e30}}),
    ("lens", "ideal", {"falloff": {0.0: 1.0, 20.0: math.nan}}),
    ("lens", "prescription", {"prescription": "triplett"}),
    ("flare", "ghosts", {"prescription": "triplett"}),
    ("flare", "ghosts", {"coating": "gold"}),
    ("flare", "aperture", {"blades": 1_000_000}),
    ("flare", "aperture", {"blades": -1}),
    ("flare", "aperture", {"dust_per_mm2": math.inf}),
    ("flare", "aperture", {"dust_per_mm2": 1e9}),
    ("flare", "aperture", {"rotation_deg": math.nan}),
    ("flare", "aperture", {"seed": -1}),
    ("sensor", "bayer", {"prnu": 5.0}),
    ("sensor", "bayer", {"prnu": 1e30}),
    ("sensor", "bayer", {"dark_spread": 1e30}),
    ("sensor", "bayer", {"inl_dn": -1.0}),
    ("sensor", "bayer", {"full_well_e": 1.0}),  # less than one code
    ("sensor", "bayer", {"qe_csv": "gone.csv"}),
    ("sensor", "split_pixel", {"fill_factor": (0.9, 0.5)}),
    ("isp", "linear", {"design_snr": 0.0}),
    ("isp", "linear", {"design_snr": -1.0}),
    ("isp", "linear", {"design_snr": math.nan}),
    ("isp", "linear", {"shading_csv": "gone.csv"}),
    ("metric", "log_luminance_error", {"floor_cd_m2": 0.0}),
)
BANDS = range(400, 701, 10)
SHAPE = (4, 6)


def cases() -> Iterator[tuple]:
    """Yield (case, call, error class); the class is None where the call must succeed."""
    for kind, name, fields in FIELDS:
        listed = ", ".join(f"{key}={value}" for key, value in fields.items())
        yield f"{kind} {name}: {listed}", partial(built, kind, name, fields), ConfigError
    for unit, scale in (("micrometres", 1e-3), ("metres", 1e-9)):
        yield f"light with wavelengths in {unit}", partial(through_lens, scale), UnitError
        yield f"a point spread at a wavelength in {unit}", partial(spread, scale), ConfigError
    for seed in (-1, 1.7, math.nan):
        yield f"the noise of seed {seed}", partial(keyed, seed), ConfigError
    yield "a sensor with noise and no generator", without_generator, ConfigError
    yield "the scalar renderer on tiles that are not square", planned_scalar, ConfigError
    yield "tiles that the scalar renderer advises", advised, None
    for what, depth in (
        ("cells", cells()),
        ("complex", np.full(SHAPE, 5 + 1j)),
        ("negative", np.full(SHAPE, -5.0)),
        ("all NaN", np.full(SHAPE, np.nan)),
    ):
        yield f"deposit scene: depthMap {what}", partial(deposit, depth=depth), UnitError
    yield "deposit scene: a band in two spellings", partial(deposit, twice=True), CatalogError
    yield "deposit scene: a link to nothing", partial(deposit, dangling=True), CatalogError


def built(kind: str, name: str, fields: dict) -> Any:
    """Return a component, built from the given fields.

    Parameters
    ----------
    kind : kind of the component, for example `lens`.
    name : registered name of the component.
    fields : fields by name.
    """
    return build(kind, name, **fields)


def through_lens(scale: float) -> Any:
    """Image light with its wavelengths multiplied by `scale`."""
    light = mixed(np.ones((31, *SHAPE), np.float32))
    return built("lens", "ideal", {})(light.assign_coords(wavelength=light.wavelength * scale))


def spread(scale: float) -> Any:
    """Compute a point spread function at 550 nm times `scale`."""
    return built("lens", "diffraction_limited", {}).psf([550.0 * scale], 1.0, 16)


def keyed(seed: Any) -> Generator:
    """Return the noise generator of a seed."""
    return generator(seed=seed)


def without_generator() -> Any:
    """Expose a sensor that cannot draw its noise."""
    light = irradiance(np.full((31, 16, 16), 1e-3, np.float32), tile_um=3.75)
    return built("sensor", "bayer", {})(light, None)


def planned_scalar(width: int = 100, height: int = 56) -> Chain:
    """Build the chain of a run with the scalar renderer, which needs no compiler.

    Parameters
    ----------
    width, height : tiles of the rendering.
    """
    return chain(
        compose(["renderer.variant=scalar", f"renderer.width={width}", f"renderer.height={height}"])
    )


def advised() -> Measured:
    """Check that the renderer accepts the size that its refusal advises."""
    planned_scalar(*nearest_square(100, 16 / 9))
    return Measured(0.0, 0.0, "no error")


def cells() -> np.ndarray:
    """Return a cell array in the form that a MATLAB file stores."""
    array = np.empty(SHAPE, object)
    for index in np.ndindex(SHAPE):
        array[index] = np.array([5.0])
    return array


def deposit(depth: np.ndarray | None = None, twice: bool = False, dangling: bool = False) -> Any:
    """Write a scene in the format of the ISETHDR deposit with one mistake, and read it.

    Parameters
    ----------
    depth : (y, x) depth map to write, m; None: none.
    twice : whether one wavelength is stored twice.
    dangling : whether a light group is a link to a missing file.
    """
    import OpenEXR

    light = np.ones(SHAPE, np.float32)
    channels = {f"S0.{nm},000nm": light for nm in BANDS}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with OpenEXR.File(
            {"type": OpenEXR.scanlineimage}, channels | ({"S0.550.000nm": light} if twice else {})
        ) as file:
            file.write(str(folder / "scene_skymap.exr"))
        if depth is not None:
            savemat(folder / "scene.mat", {"sceneMeta": {"depthMap": depth}})
        if dangling:
            (folder / "scene_headlights.exr").symlink_to(folder / "gone.exr")
        return built("scene", "iset_exr", {"folder": name, "scene_id": "scene"})()
