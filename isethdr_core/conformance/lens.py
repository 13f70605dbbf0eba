"""Promises of a lens: linear, independent bands, no gain of light, upright image, and the ideal
lens on a uniform field.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..data import camera_geometry
from ..data.quantities import PHOTOCURRENT, bands_nm, check_irradiance, full_field, tile_pitch
from ..data.temporal_modulation import components
from ..physics.detector.temporal_modulation import Modulation
from ..physics.radiometry import photons_per_energy
from ..pipeline import window
from ..pipeline.demand import Demand, Response
from ..pipeline.imaging_plan import (
    FieldAhead,
    ImagingOutline,
    LightBudget,
    TrivialPlan,
    outlined,
    plans_imaging,
)
from ..plugins.protocols import (
    HasPointSpread,
    ImagingPlan,
    KeepsLight,
    Lens,
    MakesPhotocurrent,
    NarrowsDemand,
    StatesErrors,
)
from ..uncertainty.error_terms import ErrorMaps, ErrorTerm
from ..uncertainty.ledger import LeftOut
from .inputs import damaged_planes, in_components, mixed
from .lazy import same_from_store
from .promise import close, holds, keeps, refuses, repeatable, safe_in_threads, same, stated

# error allowed as a fraction of the largest value; float32 results of Fourier transforms of this
# size have an error of 1e-6 of it
ROUNDING = 1e-5
# relative error allowed: attributes have one number for all bands, but the sizes of pupil and image
# depend on wavelength, by 0.4 % in a double Gauss (mean of 400 to 700 nm)
COLOURS = 1e-2
AREA_EXPOSURE_M2_S = 3e-6**2 * 0.016  # a pixel of 3 um, 16 ms


def check(subject: str, lens: Lens) -> None:
    """Check one lens without flare."""
    scene = mixed()
    light = repeatable(subject, lens, mixed)
    with keeps(subject, "returns irradiance with its attributes"):
        check_irradiance(light)
    same_from_store(subject, lens, scene, light)
    half = mixed(0.5 * scene.values)
    safe_in_threads(subject, lens, [partial(lens, one) for one in (scene, half)])
    same(subject, "no flare is the default", light, stated(subject, lambda: lens(scene, flares=())))
    holds(
        subject,
        "x and y keep their direction",
        light.x[0] < 0 < light.x[-1] and light.y[0] < 0 < light.y[-1],
    )
    holds(
        subject,
        "f-number, focal length and throughput are above 0",
        min(light.attrs[k] for k in ("f_number", "focal_length_mm", "throughput_sr")) > 0,
    )
    _check_border(subject, light)
    _check_linear(subject, lens, scene, light)
    _check_energy(subject, lens)
    _check_orientation(subject, lens)
    if isinstance(lens, HasPointSpread):
        _check_psf(subject, lens)
    _check_components(subject, lens, scene, light)
    if isinstance(lens, NarrowsDemand):
        bands = tuple(scene.wavelength.values.tolist())
        kept_nm = lens.narrow(Demand(wavelength_nm=bands)).wavelength_nm
        dropped = set() if kept_nm is None else set(bands) - set(kept_nm)
        dark = light.sel(wavelength=[w for w in light.wavelength.values if w in dropped])
        # 1e-6: below the noise of every sensor
        holds(
            subject,
            "passes no light in a band that its narrow drops",
            float(dark.max() if dark.size else 0.0) <= 1e-6 * float(light.max()),
        )
    _check_plan(subject, lens, scene, light)
    if isinstance(lens, KeepsLight):
        with keeps(subject, "keeps_light returns True or False"):
            kept = lens.keeps_light(())
        found = isinstance(kept, bool | np.bool_)
        holds(subject, "keeps_light returns True or False", found, repr(kept))
    if isinstance(lens, MakesPhotocurrent):
        _check_photocurrent(subject, lens, scene, light)
        _check_window(subject, lens, scene)
    for fault, damaged in damaged_planes(scene):
        refuses(subject, fault, partial(lens, damaged))


def _check_border(subject: str, light: xr.DataArray) -> None:
    """Check that light states how it falls off the axis, and covers the field that it states."""
    falloff = light.attrs.get("falloff")
    promise = f"the attribute falloff of its light is one of {camera_geometry.FALLOFFS}"
    holds(subject, promise, falloff in camera_geometry.FALLOFFS, repr(falloff))
    stated_m = np.array([light.attrs["field_width"], light.attrs["field_height"]])
    covered_m = np.array(full_field(light))
    covers = (covered_m >= stated_m * (1 - ROUNDING)).all()
    found = f"it covers {covered_m.tolist()} m of {stated_m.tolist()} m"
    holds(subject, "its light covers field_width and field_height", covers, found)


def _check_plan(subject: str, lens: Lens, scene: xr.DataArray, light: xr.DataArray) -> None:
    """Check that the plan of a lens, which makes the light of a run, makes the light of its call,
    and that the stated errors lie on the tiles of this light.
    """
    if plans_imaging(lens):
        with keeps(subject, "plans the imaging of a field"):
            plan = lens.plan((), scene, None, LightBudget())
        _check_statements(subject, plan)
        with keeps(subject, "its plan images the field that it was made for"):
            planned = plan.image(scene)
            check_irradiance(planned)
        found = f"got {dict(planned.sizes)}, expected {dict(light.sizes)}"
        promise = "its plan makes the light of its call, where no error is allowed"
        holds(subject, promise, dict(planned.sizes) == dict(light.sizes), found)
        close(subject, promise, planned.values, light.values, 0.0, ROUNDING * float(light.max()))
        for dim in ("wavelength", "y", "x"):
            close(subject, promise, planned[dim].values, light[dim].values, ROUNDING)
        _check_light_errors(subject, plan, scene, light)
        promise = "outline returns an ImagingOutline"
        with keeps(subject, promise):
            outline = outlined(lens, (), FieldAhead(), LightBudget())
        holds(subject, promise, isinstance(outline, ImagingOutline), repr(outline))
    if isinstance(lens, StatesErrors):
        _check_light_errors(subject, TrivialPlan(lens), scene, light)


def _check_statements(subject: str, plan: ImagingPlan) -> None:
    """Check the errors and omissions of a plan, which a run writes into its ledger."""
    promise = "its plan has the sequences `terms` of ErrorTerm and `left_out` of LeftOut"
    with keeps(subject, promise):
        terms = list(plan.terms)
        left_out = list(plan.left_out)
    holds(subject, promise, all(isinstance(term, ErrorTerm) for term in terms), repr(terms))
    holds(subject, promise, all(isinstance(note, LeftOut) for note in left_out), repr(left_out))


def _check_light_errors(
    subject: str, plan: ImagingPlan, scene: xr.DataArray, light: xr.DataArray
) -> None:
    """Check the errors of light tile by tile: standard deviation and bound."""
    bands = scene.sizes["wavelength"]
    weights = np.stack([np.ones(bands), np.linspace(0.0, 1.0, bands)])
    promise = "light_errors returns ErrorMaps, each of shape (channel, y, x) of its light, or None"
    with keeps(subject, promise):
        maps = plan.light_errors(scene, weights)
    if maps is None:
        return
    holds(subject, promise, isinstance(maps, ErrorMaps), f"got {type(maps).__name__}")
    expected = (len(weights), light.sizes["y"], light.sizes["x"])
    for name, values in (("deviation", maps.deviation), ("bound", maps.bound)):
        values = np.asarray(values)
        found = f"{name} has the shape {values.shape}, expected {expected}"
        holds(subject, promise, values.shape == expected, found)
        holds(subject, "light_errors are 0 or more, not NaN", bool((values >= 0).all()), name)


def _check_components(subject: str, lens: Lens, scene: xr.DataArray, light: xr.DataArray) -> None:
    with keeps(
        subject,
        "accepts light with components (isethdr_core.data.temporal_modulation.each_component)",
    ):
        pulsed = lens(in_components(scene, frequency_hz=90.0, duty=0.1, phase=0.3))
    holds(
        subject,
        "copies the modulation of each component",
        [m for m, _ in components(pulsed)] == [Modulation(90.0, 0.1, 0.0, 0.3)],
    )
    same(
        subject,
        "one component is imaged as light without components",
        components(pulsed)[0][1],
        light,
    )


def _check_photocurrent(
    subject: str, lens: MakesPhotocurrent, scene: xr.DataArray, irradiance: xr.DataArray
) -> None:
    """Check that light requested as photocurrent makes the same electrons as irradiance, within the
    requested error.
    """

    def efficiency(wavelength_nm: npt.ArrayLike) -> np.ndarray:
        return np.stack(
            [np.full(np.size(wavelength_nm), 0.5), np.asarray(wavelength_nm, float) / 1000.0]
        )

    response = Response(("flat", "rising"), efficiency, AREA_EXPOSURE_M2_S, 1.0, 1e5)
    light = lens.photocurrent(scene, (), response)
    counting = response.efficiency(bands_nm(irradiance)) * photons_per_energy(bands_nm(irradiance))
    want = AREA_EXPOSURE_M2_S * np.tensordot(counting, irradiance.values, 1)
    if light.attrs["units"] == PHOTOCURRENT:
        electrons = AREA_EXPOSURE_M2_S * light.values
    else:
        electrons = AREA_EXPOSURE_M2_S * np.tensordot(counting, light.values, 1)
    promise = (
        "photocurrent makes the electrons that its irradiance makes, within the error allowed (in"
        " units of the noise)"
    )
    # factor five: the error allowed holds for 99 % of the pixels
    close(
        subject,
        promise,
        (electrons - want) / np.sqrt(1 + want),
        0.0,
        0.0,
        5 * response.noise_fraction_allowed,
    )


def _check_window(subject: str, lens: MakesPhotocurrent, scene: xr.DataArray) -> None:
    """Check that light requested in a window equals the light requested for the whole sensor plane,
    within the requested error.
    """
    response = Response(
        ("W",), lambda w: np.full((1, np.size(w)), 0.5), AREA_EXPOSURE_M2_S, 1.0, 1e5
    )

    def electrons(light: xr.DataArray, window_m: tuple[float, float]) -> np.ndarray:
        counting = response.efficiency(bands_nm(light)) * photons_per_energy(bands_nm(light))
        light = light.isel(window.tiles(light, window_m))
        return AREA_EXPOSURE_M2_S * (
            light.values
            if light.attrs["units"] == PHOTOCURRENT
            else np.tensordot(counting, light.values, 1)
        )

    every = lens.photocurrent(scene, (), response)
    width_m, height_m = full_field(every)
    window_m = (width_m / 2, height_m / 2)
    with keeps(subject, "answers a response that states a window"):
        part = electrons(
            lens.photocurrent(scene, (), replace(response, window_m=window_m)), window_m
        )
    full_light = electrons(every, window_m)
    # factor two: each of the two results may have the error allowed
    close(
        subject,
        "a window in the response does not change the light in it, within the error allowed",
        part,
        full_light,
        0.0,
        2 * response.noise_fraction_allowed * np.sqrt(1 + full_light.min()),
    )


def _check_linear(subject: str, lens: Lens, scene: xr.DataArray, light: xr.DataArray) -> None:
    peak = float(light.max())
    other_scene = mixed(0.01 - scene.values)
    sum_of_scenes = mixed(scene.values.astype(float) + 3.0 * other_scene.values)
    close(
        subject,
        "linear in radiance",
        lens(sum_of_scenes).values,
        light.values.astype(float) + 3.0 * lens(other_scene).values.astype(float),
        ROUNDING,
        4 * ROUNDING * peak,
    )
    holds(subject, "no light in, no light out", float(lens(mixed(0.0)).max()) == 0.0)
    # adjacent bands: a band reaches half way to its neighbours, so it would become wider if every
    # other band were left out
    part = lens(scene.isel(wavelength=slice(1, 4))).values
    close(
        subject,
        "a band does not depend on which other bands are there",
        part,
        light.values[1:4],
        ROUNDING,
        ROUNDING * peak,
    )


def _check_energy(subject: str, lens: Lens) -> None:
    uniform = lens(mixed(0.01))
    expected = uniform.attrs["throughput_sr"] * np.float32(0.01)
    middle = uniform.isel(
        y=slice(uniform.sizes["y"] // 2 - 1, uniform.sizes["y"] // 2 + 1),
        x=slice(uniform.sizes["x"] // 2 - 1, uniform.sizes["x"] // 2 + 1),
    ).mean("wavelength")
    # 2 %: a wide point spread function collects light from beyond the field, which is missing here
    # even in the middle
    close(
        subject,
        "a uniform field gives throughput_sr times radiance in the middle",
        middle.values,
        expected,
        2e-2,
    )
    passed = expected * _relative(uniform)
    total = float(uniform.mean("wavelength").sum())
    holds(
        subject,
        "the light of a uniform field is at most throughput_sr times radiance times the stated"
        " relative illumination",
        total <= passed.sum() * (1 + COLOURS),
        f"{total:.6g} > {passed.sum():.6g}",
    )
    more = float((uniform.max("wavelength").values - passed).max() / expected)
    # 2 %: coma and lateral colour move light from one place to another
    holds(
        subject,
        "a uniform field exceeds the stated light nowhere by 2 % of that on the axis",
        more <= 2e-2,
        f"{more:.4f} more",
    )


def _check_orientation(subject: str, lens: Lens) -> None:
    values = np.zeros((5, 24, 32))
    values[:, 5, 24] = 0.01  # up and to the right of the axis: x > 0, y < 0
    point = lens(mixed(values)).sum("wavelength")
    y, x = map(int, np.unravel_index(int(point.values.argmax()), point.shape))
    holds(
        subject,
        "a lamp up and to the right lands at y < 0 < x (x right, y down, upright)",
        point.y[y] < 0 < point.x[x],
        f"it landed at x = {float(point.x[x]):.3g} m, y = {float(point.y[y]):.3g} m",
    )
    _check_place(subject, lens, point, mixed(values), (y, x))
    source = mixed(values)
    more = float(point.sum()) - float(source.sum()) * _passed_sr(lens, source) * _tiles_ratio(
        source, point
    )
    holds(
        subject,
        "a lamp's light on the sensor is at most what went through the pupil",
        more <= COLOURS * float(point.sum()),
        f"{more:.3g} more",
    )


def _check_place(
    subject: str, lens: Lens, point: xr.DataArray, source: xr.DataArray, peak: tuple[int, int]
) -> None:
    """Check that the image of a lamp lies at the position that focal length and distortion state,
    to one tile.
    """
    light = lens(source)
    f_m = 1e-3 * light.attrs["focal_length_mm"]
    row, column = np.argwhere(source.values.sum(axis=0))[0]
    want_x, want_y = (
        f_m * float(c)
        for c in camera_geometry.map_of(light).forward(
            float(source.x[column]), float(source.y[row])
        )
    )
    x = float(point.x[peak[1]])
    y = float(point.y[peak[0]])
    off = max(abs(x - want_x) / tile_pitch(light, "x"), abs(y - want_y) / tile_pitch(light, "y"))
    holds(
        subject,
        "a lamp is imaged at the position that focal length and distortion state, within a tile",
        off <= 1.0,
        f"at ({x:.4g}, {y:.4g}) m, stated ({want_x:.4g}, {want_y:.4g}) m, {off:.1f} tiles off",
    )


def _relative(light: xr.DataArray) -> np.ndarray:
    """Return the relative illumination (y, x) that light on the sensor states."""
    f_m = 1e-3 * light.attrs["focal_length_mm"]
    return camera_geometry.relative_illumination(
        light.attrs, light.x.values[None, :] / f_m, light.y.values[:, None] / f_m
    )


def _passed_sr(lens: Lens, source: xr.DataArray) -> float:
    """Return the solid angle of light from the brightest tile that passes the pupil, from the
    attributes: throughput, relative illumination, image size.
    """
    image = lens(mixed(0.01))
    row, column = np.unravel_index(int(source.values.sum(axis=0).argmax()), source.shape[1:])
    x = float(source.x[column])
    y = float(source.y[row])
    distortion = camera_geometry.map_of(image)
    on_sensor = camera_geometry.relative_illumination(image.attrs, *distortion.forward(x, y))
    passed = on_sensor * distortion.area_ratio(x, y)
    return float(image.attrs["throughput_sr"]) * float(passed)


def _tiles_ratio(source: xr.DataArray, image: xr.DataArray) -> float:
    """Return the number of image tiles that one tile of the source covers on the axis.

    It is 1 for a lens that keeps the grid.
    """
    f_m = 1e-3 * image.attrs["focal_length_mm"]
    return math.prod(float(f_m * tile_pitch(source, d) / tile_pitch(image, d)) for d in "xy")


def _check_psf(subject: str, lens: HasPointSpread) -> None:
    spread = lens.psf(wavelength_nm=[450.0, 550.0, 650.0], pitch_um=1.0, size=64)
    values = np.asarray(spread)
    holds(
        subject,
        "psf has the shape (wavelength, y, x)",
        values.shape == (3, 64, 64),
        str(values.shape),
    )
    total = values.sum(axis=(1, 2))
    holds(subject, "psf holds no negative energy", values.min() >= 0, f"{values.min():.3g}")
    holds(subject, "psf sums to at most 1", total.max() <= 1 + 1e-6, str(total))
