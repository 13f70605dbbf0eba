"""Propagation: the stated errors of all stages as errors of the electrons of each capture, in units
of the sensor's own noise.

Propagation is linear. The renderer's noise is known tile by tile (`render_noise`). Errors of the
stages after it are shares of the electrons they act on (`error_terms`). In each pixel, bounds and
measured errors are summed to b, and the squares of statistical errors to the variance s^2. The
error of the pixel is then b + |normal deviate of standard deviation s|. A figure of a picture is
the 99th percentile of the errors of its unsaturated pixels (`within`). There are figures of the
renderer, of all stages after it up to the sensor, of the sensor, and of all together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import erf

from ..data import camera_geometry
from ..data.quantities import IRRADIANCE, PHOTOCURRENT
from ..data.reference_picture import mean_over_pixels
from ..data.temporal_modulation import time_mean
from ..physics.radiometry import photons_per_energy
from ..physics.resampling.area import detail_error, resample_mean
from . import error_terms, ledger
from .error_terms import ErrorMaps, ErrorTerm, LightPart, Quantity, Reading, Source
from .ledger import Row
from .render_noise import nearest_xyz, pixel_variance, relative_noise

if TYPE_CHECKING:
    import xarray as xr

    MapsOfErrors = Callable[[xr.DataArray, np.ndarray], ErrorMaps | None]

UNIT = "standard deviations of the sensor's noise"
# kinds of the stages after the renderer whose errors propagate to the electrons. Of `radiance` only
# the rounding of the store counts: the errors that it restates are those of the renderer
AFTER = ("scene", "radiance", "lighting", "lens", "flare")
UNITS = (error_terms.RELATIVE, IRRADIANCE, "electrons", UNIT)  # of errors of a pixel's electrons
# keys of the figures of a picture
RENDERER = "renderer"
AFTER_RENDERER = "all after the renderer"
SENSOR = "sensor"
WHOLE = "all stages"
TWO_SIDED = 2.5758  # 99 % of normal deviates are within this number of standard deviations
MOST_PIXELS = 65536  # largest regular sample of pixels
ENOUGH = 32768  # smallest regular sample of the pixels of a capture
# relative tolerance of a figure: a figure with more errors is never smaller than one with fewer,
# except by this
CLOSE = 1e-9
SMALL = 1e-30  # share of the largest error; smaller limits count as 0
SHARE = 0.99  # of the pixels, within the figure that is stated for a picture


@dataclass(frozen=True, eq=False)
class Electrons:
    """Mean light electrons of one capture (y, x), those of direct light, and the noise."""

    capture: str
    total: np.ndarray
    image: np.ndarray  # of direct light, neither blurred nor scattered
    sigma: np.ndarray  # standard deviation of shot, read and converter noise
    renderer: np.ndarray  # standard deviation that the noise of the scene makes
    unsaturated: np.ndarray
    per_irradiance: float  # electrons per W m-2 nm-1 in every band, of the most sensitive channel
    maps: ErrorMaps | None = None  # (y, x) each: errors that the lens states pixel by pixel
    # electrons of the parts of the light that stages declared
    parts: Mapping[str, np.ndarray] = field(default_factory=dict)


class Seconds(NamedTuple):
    """What a picture took."""

    rendering: float  # in this run or when it was stored
    later: float  # everything after it


class Bounds(NamedTuple):
    """The errors (y, x) of one capture: bounds, and the standard deviation of statistical ones."""

    bound: np.ndarray
    deviation: np.ndarray


class TermsAfter(NamedTuple):
    """Errors of the stages after the renderer."""

    of_electrons: list[ErrorTerm]
    without_electrons: list[ErrorTerm]  # that have no way to electrons


class Rates(NamedTuple):
    """Per m2 and second, at each pixel (y, x) in its own channel."""

    total: np.ndarray  # all electrons
    image: np.ndarray  # those of the tiles that the pixel looks at
    renderer: np.ndarray  # standard deviation that the noise of the scene makes

    def scaled(self, scale: float) -> Rates:
        """Return the rates times `scale`."""
        return Rates(*(scale * values for values in self))


def missing(captures: xr.Dataset) -> list[str]:
    """Return what `electrons` needs and captures of a sensor lack; what an isp of ours reads is
    enough.
    """
    needed = (
        "quantum_efficiency",
        "filter",
        "saturated",
        "exposure_s",
        "area_m2",
        "read_noise_e",
        "quantisation_e",
        "dark_e",
    )
    return [n for n in needed if n not in captures] + [
        n for n in ("focal_length_mm", "throughput_sr", "pitch_um") if n not in captures.attrs
    ]


def regular_sample(captures: xr.Dataset) -> xr.Dataset:
    """Subsample the captures on a regular grid of at least `ENOUGH` pixels.

    Distorting lenses need every pixel, so their captures are returned unchanged. The ledger states
    the error of the sample: three standard errors of the share of pixels within a figure.
    """
    sizes = [captures.sizes[d] for d in ("y", "x")]
    step = int(np.sqrt(np.prod(sizes) / ENOUGH))
    step -= step % 2 == 0  # odd: every colour of a filter array is sampled
    if step < 3 or not isinstance(camera_geometry.map_of(captures), camera_geometry.Identity):
        return captures
    sampled = captures.isel(
        {d: slice(min(step // 2, n - 1), None, step) for d, n in zip(("y", "x"), sizes)}
    )
    count = sampled.sizes["y"] * sampled.sizes["x"]
    ledger.left_out(
        f"errors of {np.prod(sizes) - count} of {np.prod(sizes)} pixels",
        f"estimated from a sample: one pixel in {step} along each axis",
        3 * float(np.sqrt(SHARE * (1 - SHARE) / count)),
        f"of the pixels, added to or subtracted from the {SHARE:.0%} of a figure",
        needless=True,
    )
    return sampled


@dataclass(frozen=True, eq=False)
class Exposure:
    """The captures of one shot, and the light from which they were made.

    Attributes
    ----------
    captures : captures Dataset.
    light : irradiance or photocurrent on the sensor plane.
    mixed : mixed radiance that the light was made of, W m-2 sr-1 nm-1.
    scene : scene radiance, with `xyz_noise` where a renderer states it.
    """

    captures: xr.Dataset
    light: xr.DataArray
    mixed: xr.DataArray
    scene: xr.Dataset


def electrons(
    exposure: Exposure, scene_noise: float = 0.0, error_maps: MapsOfErrors | None = None
) -> list[Electrons]:
    """Return what each capture holds, from the light itself.

    Parameters
    ----------
    exposure : the captures and their light.
    scene_noise : relative noise of a scene that states none tile by tile, as `stated_noise`.
    error_maps : function(mixed, weights) -> `ErrorMaps` of `weights` (channel, band) times
        irradiance, on the grid of the light, or None. Where there is none, the terms that the lens
        states are taken.
    """
    captures = exposure.captures
    light = time_mean(exposure.light)
    mixed = time_mean(exposure.mixed)
    at_mean = replace(exposure, light=light, mixed=mixed)
    noise = relative_noise(exposure.scene, mixed)
    # most captures see light alike
    rates_of_light: dict[bytes, tuple[Rates, ErrorMaps | None]] = {}
    out = []
    for k, name in enumerate(map(str, captures.capture.values)):
        capture = captures.isel(capture=k)
        counting = capture["quantum_efficiency"].values * photons_per_energy(
            captures.wavelength.values
        )
        if counting.tobytes() not in rates_of_light:
            maps = error_maps(mixed, counting) if error_maps else None
            rates_of_light[counting.tobytes()] = (
                _rates(counting, at_mean, noise, scene_noise),
                _at_filters(maps, captures, light),
            )
        scale = float(capture["exposure_s"]) * float(capture["area_m2"])
        rates, maps = rates_of_light[counting.tobytes()]
        rates = rates.scaled(scale)
        if maps is not None:
            maps = maps._replace(deviation=scale * maps.deviation, bound=scale * maps.bound)
        read = float(capture["read_noise_e"]) ** 2 + float(capture["quantisation_e"]) ** 2 / 12
        variance = np.maximum(rates.total + float(capture["dark_e"]) + read, np.finfo(float).tiny)
        out.append(
            Electrons(
                capture=name,
                total=rates.total,
                image=rates.image,
                sigma=np.sqrt(variance),
                renderer=rates.renderer,
                unsaturated=~capture["saturated"].values,
                per_irradiance=scale * float(counting.sum(1).max()),
                maps=maps,
            )
        )
    return out


def with_parts(
    shots: list[Electrons], captures: xr.Dataset, rows: Sequence[Row]
) -> list[Electrons]:
    """Return the shots with the electrons of every part of the light that a row declares
    (`ledger.light_part`).

    Parameters
    ----------
    shots : one per capture, as `electrons` returns them.
    captures : captures Dataset that the shots are of.
    rows : rows of the ledger.
    """
    declared = {name: part for row in rows for name, part in row.light_parts.items()}
    if not declared:
        return shots
    out = []
    for k, shot in enumerate(shots):
        parts = {}
        for name, part in declared.items():
            if part.reading is Reading.IMAGE:
                parts[name] = shot.image
            elif part.reading is Reading.REST:
                parts[name] = np.maximum(shot.total - shot.image, 0.0)
            else:
                parts[name] = _at_pixels(captures.isel(capture=k), part)
        out.append(replace(shot, parts=parts))
    return out


def _at_pixels(captures: xr.Dataset, part: LightPart) -> np.ndarray:
    """Return the electrons of one capture that a part of the light makes at each pixel in its own
    channel.
    """
    light = part.light
    assert light is not None  # a part without light is read from all light
    energy = photons_per_energy(captures.wavelength.values)
    counting = captures["quantum_efficiency"].values * energy
    scale = float(captures["exposure_s"]) * float(captures["area_m2"])
    over_pixels = detail_error if part.reading is Reading.DEVIATION else resample_mean
    side = captures.attrs["pitch_um"] * 1e-6
    place = (captures.x.values, captures.y.values)
    filters = captures["filter"].values
    out = np.zeros(filters.shape)
    for channel, row in enumerate(counting):
        mine = filters == channel
        if mine.any():
            plane = light_plane(row, captures, light)
            out[mine] = over_pixels(plane, light.x.values, light.y.values, *place, side, side)[mine]
    return scale * out


def _at_filters(
    maps: ErrorMaps | None, captures: xr.Dataset, light: xr.DataArray
) -> ErrorMaps | None:
    """Return error maps (y, x) of the pixels from maps (channel, y, x) of light.

    Errors of neighbouring tiles are taken as fully correlated.
    """
    if maps is None:
        return None
    side = captures.attrs["pitch_um"] * 1e-6
    filters = captures["filter"].values
    out = np.zeros((2, *filters.shape))
    for pixel_errors, planes in zip(out, (maps.deviation, maps.bound)):
        for channel, plane in enumerate(planes):
            if (mine := filters == channel).any():
                pixel_errors[mine] = resample_mean(
                    plane,
                    light.x.values,
                    light.y.values,
                    captures.x.values,
                    captures.y.values,
                    side,
                    side,
                )[mine]
    return maps._replace(deviation=out[0], bound=out[1])


def stated_noise(rows: Sequence[Row]) -> float:
    """Return the largest relative noise of a light group that a renderer states; 0 without one."""
    return max(
        (
            term.value
            for row in rows
            for term in row.errors
            if term.source.kind == "renderer"
            and (term.unit, term.how) == (error_terms.RELATIVE, "statistical")
        ),
        default=0.0,
    )


def _rates(
    counting: np.ndarray, exposure: Exposure, noise: np.ndarray | None, scene_noise: float
) -> Rates:
    """Return the electrons per m2 and second of one capture, and their error.

    Parameters
    ----------
    counting : electrons per energy in each channel and band.
    exposure : with light and mixed radiance constant over time.
    noise : relative standard errors (3, y, x) of X, Y and Z of the mixed radiance; None for none.
    scene_noise : relative noise of all direct light where `noise` is None.
    """
    captures = exposure.captures
    light = exposure.light
    mixed = exposure.mixed
    f_m = captures.attrs["focal_length_mm"] * 1e-3
    gain = captures.attrs["throughput_sr"] * camera_geometry.relative_illumination(
        captures.attrs, captures.x.values[None, :] / f_m, captures.y.values[:, None] / f_m
    )
    side = captures.attrs["pitch_um"] * 1e-6
    place = (captures.x.values, captures.y.values)
    filters = captures["filter"].values
    total, image, variance = np.zeros((3, *filters.shape))
    for channel, row in enumerate(counting):
        mine = filters == channel
        if not mine.any():
            continue
        tiles = band_sum(row, mixed.values)
        total[mine] = resample_mean(
            light_plane(row, captures, light), light.x.values, light.y.values, *place, side, side
        )[mine]
        image[mine] = (gain * mean_over_pixels(tiles, mixed, captures))[mine]
        if noise is not None:
            of_channel = noise[nearest_xyz(row, mixed.wavelength.values)]
            of_pixels = pixel_variance((of_channel * tiles) ** 2, mixed, captures)
            variance[mine] = (gain**2 * of_pixels)[mine]
    return Rates(total, image, np.sqrt(variance) if noise is not None else scene_noise * image)


def light_plane(row: np.ndarray, captures: xr.Dataset, light: xr.DataArray) -> np.ndarray:
    """Return the electrons per m2 and second (y, x) of light in one channel.

    Parameters
    ----------
    row : (band,) electrons per energy of the channel.
    captures : captures, for their bands.
    light : irradiance or photocurrent.
    """
    if light.attrs["units"] != PHOTOCURRENT:
        return band_sum(
            row[np.isin(captures.wavelength.values, light.wavelength.values)], light.values
        )
    efficiency = row / photons_per_energy(captures.wavelength.values)
    # not 0 with crosstalk, which mixes channels
    differences = np.abs(np.asarray(light.attrs["efficiency"]) - efficiency).max(1)
    plane: np.ndarray = light.values[int(differences.argmin())]
    return plane


def band_sum(row: np.ndarray, cube: np.ndarray) -> np.ndarray:
    """Return the sum over bands (y, x) of `row` (band,) times `cube` (band, y, x), float64."""
    out = np.zeros(cube.shape[1:])
    for weight, band in zip(row, cube):
        if weight:
            out += weight * band
    return out


def after(shot: Electrons, terms: Sequence[ErrorTerm]) -> Bounds:
    """Return the errors of `terms` in electrons of one capture, as bounds and deviations.

    Terms that do not propagate to electrons are skipped.
    """
    linear = np.zeros(shot.total.shape)
    squares = np.zeros(shot.total.shape)
    if shot.maps:
        linear = linear + shot.maps.bound
        squares = squares + shot.maps.deviation**2
    for term in terms:
        error_e = _in_electrons(term, shot)
        if error_e is None:
            continue
        if term.how == "statistical":
            squares += error_e**2
        else:
            linear += error_e
    return Bounds(linear, np.sqrt(squares))


def within(bound: np.ndarray, deviation: np.ndarray, share: float = SHARE) -> float:
    """Return the limit that a share of all errors does not exceed.

    Each error is a bound plus the magnitude of a normal deviate.

    Parameters
    ----------
    bound : bound of each error, any shape and unit.
    deviation : standard deviation of each error's normal part, same shape and unit.
    share : share of the errors, above 0 and below 1.
    """
    from scipy.optimize import brentq

    step = max(1, bound.size // MOST_PIXELS) | 1  # odd: every colour of a filter array is sampled
    bound, deviation = (np.ravel(a)[::step].astype(float) for a in (bound, deviation))
    normal = deviation > 0
    scale = np.sqrt(2) * np.where(normal, deviation, 1.0)

    def missing(limit: float) -> float:
        with np.errstate(over="ignore"):  # far above a bound of little deviation: erf(inf) is 1
            within_deviation = erf(np.maximum(limit - bound, 0.0) / scale)
        below = np.where(limit >= bound, np.where(normal, within_deviation, 1.0), 0.0)
        return target - float(below.mean())

    # just below `share`: the root is then the smallest limit with that share
    target = float(np.nextafter(share, 0.0))
    highest = float((bound + 10 * deviation).max())
    if not np.isfinite(highest) or missing(highest) > 0:
        return highest  # an error is infinite, or most errors are bounds of this value
    if missing(0.0) <= 0:
        return 0.0  # so many errors are exactly 0
    # bounds without deviation make steps, at which the method halves the interval each time
    xtol = SMALL * highest
    return float(brentq(missing, 0.0, highest, xtol=xtol, rtol=CLOSE, maxiter=1000))


def _in_electrons(term: ErrorTerm, shot: Electrons) -> np.ndarray | float | None:
    """Return the error of a term in electrons, (y, x) or one for all pixels; None if its unit does
    not propagate.
    """
    if term.unit == error_terms.RELATIVE:
        # a part that no stage declared is at most all light
        return term.value * (shot.parts.get(term.part, shot.total) if term.part else shot.total)
    if term.unit == IRRADIANCE:
        return term.value * shot.per_irradiance
    if term.unit == "electrons":
        return term.value
    return term.value * shot.sigma if term.unit == UNIT else None


def terms_after(rows: Sequence[Row], replaced: Sequence[str] = ()) -> TermsAfter:
    """Return the errors of the stages after the renderer, up to the sensor.

    Parameters
    ----------
    rows : rows of a ledger. A restated term counts by its source.
    replaced : keys of terms of the lens that are known pixel by pixel; they are left out.
    """
    terms = [
        term
        for row in rows
        for term in row.errors
        if term.source.kind in AFTER and term.acts_on != Quantity.TARGET
    ]
    with_electrons: list[ErrorTerm] = []
    without: list[ErrorTerm] = []
    for term in error_terms.largest_alternatives(terms):
        if term.unit not in UNITS or term.acts_on not in error_terms.LIGHT:
            without += [term] if term.value else []
        elif not (term.source.kind == "lens" and term.source.key in replaced):
            with_electrons.append(term)
    return TermsAfter(with_electrons, without)


def _terms_of(shot: Electrons, rows: Sequence[Row]) -> TermsAfter:
    return terms_after(rows, shot.maps.replaces if shot.maps else ())


def terms_of_sensor(rows: Sequence[Row]) -> list[ErrorTerm]:
    """Return the errors of electrons that sensors state.

    Noise and non-linearity are properties of a sensor, not errors.
    """
    terms = [
        term
        for row in rows
        for term in row.errors
        if term.source.kind == "sensor"
        and term.acts_on == Quantity.ELECTRONS
        and term.unit in UNITS
    ]
    return error_terms.largest_alternatives(terms)


@dataclass(frozen=True)
class Figures:
    """Errors of one capture, which 99 % of its unsaturated pixels do not exceed.

    The unit is the standard deviation of its noise.
    """

    all_stages: float
    renderer: float
    later: float  # stages after the renderer, up to the sensor
    sensor: float
    worst: float  # of the worst pixel, 99th percentile
    capture: str


def figures_of(
    shot: Electrons, terms: Sequence[ErrorTerm], of_sensor: Sequence[ErrorTerm] = ()
) -> Figures | None:
    """Return the figures of one capture, None where all its pixels are saturated.

    Parameters
    ----------
    shot : the capture.
    terms : error terms of the stages after the renderer.
    of_sensor : error terms of the sensor, as `terms_of_sensor` returns them.
    """
    use = shot.unsaturated
    if not use.any():
        return None
    renderer = shot.renderer[use] / shot.sigma[use]
    bound, deviation = (e[use] / shot.sigma[use] for e in after(shot, terms))
    sensor_errors = [e[use] / shot.sigma[use] for e in after(replace(shot, maps=None), of_sensor)]
    bounds = bound + sensor_errors[0]
    deviations = np.sqrt(renderer**2 + deviation**2 + sensor_errors[1] ** 2)
    return Figures(
        all_stages=within(bounds, deviations),
        renderer=within(np.zeros_like(renderer), renderer),
        later=within(bound, deviation),
        sensor=within(*sensor_errors),
        worst=float((bounds + TWO_SIDED * deviations).max()),
        capture=shot.capture,
    )


def record_figures(
    shots: Sequence[Electrons], rows: Sequence[Row], allowed: float, seconds: Seconds
) -> None:
    """State the error of a picture in units of its own noise: of the worst capture, then of each.

    Parameters
    ----------
    shots : as `electrons` returns them.
    rows : rows of the ledger; of the sensors only the row of this picture.
    allowed : largest error of all stages after the renderer, as a share of the noise.
    seconds : run time of the picture.
    """
    terms = {shot.capture: _terms_of(shot, rows) for shot in shots}
    sensor_terms = terms_of_sensor(rows)
    figures = [
        figure
        for shot in shots
        if (figure := figures_of(shot, terms[shot.capture].of_electrons, sensor_terms))
    ]
    if not figures:
        label = "no pixel is below saturation"
        _record_figure(0.0, "statistical", label, WHOLE)
        return
    most = max(figures, key=lambda figure: figure.all_stages)
    label = (
        f"99 % of the unsaturated pixels of {most.capture} (worst pixel {most.worst:.3g}): renderer"
        f" {most.renderer:.3g} in {seconds.rendering:.3g} s; later stages {most.later:.3g} of the"
        f" allowed {allowed:g} in {seconds.later:.3g} s{_why(figures, shots, rows, allowed)}; error"
        f" of the sensor {most.sensor:.3g}"
    )
    _record_figure(most.all_stages, "statistical", label, WHOLE)
    for figure in figures:
        of = f"electrons of {figure.capture}"
        _record_figure(figure.renderer, "statistical", f"{of}: renderer", RENDERER, figure.capture)
        label = f"{of}: all after the renderer"
        _record_figure(figure.later, "bound", label, AFTER_RENDERER, figure.capture)
        label = f"{of}: counted by the sensor"
        _record_figure(figure.sensor, "bound", label, SENSOR, figure.capture)
    if any(row.kind == "radiance" for row in rows) and not any(
        shot.renderer.any() for shot in shots
    ):
        ledger.left_out(
            "noise of the renderer",
            "the renderer states none; it does with several passes, or with more samples",
            np.inf,
            UNIT,
        )
    for term in terms[shots[-1].capture].without_electrons:
        ledger.left_out(
            term.label, "no error of a pixel's electrons follows from it", term.value, term.unit
        )


def _record_figure(
    value: float, how: error_terms.How, label: str, key: str, capture: str | None = None
) -> None:
    term = ErrorTerm(Source(key=key), Quantity.ELECTRONS, capture, value, UNIT, how, label)
    ledger.record(term)


def _why(
    figures: Sequence[Figures], shots: Sequence[Electrons], rows: Sequence[Row], allowed: float
) -> str:
    """Return the largest cause of an error above the allowed one; "" if the error is allowed."""
    most = max(figures, key=lambda figure: figure.later)
    if most.later <= allowed:
        return ""
    shot = next(s for s in shots if s.capture == most.capture)
    alone = replace(shot, maps=None, renderer=np.zeros_like(shot.renderer))
    causes = [(_later(alone, [term]), term.label) for term in _terms_of(shot, rows).of_electrons]
    if shot.maps:
        causes.append((_later(replace(alone, maps=shot.maps), []), shot.maps.label))
    share, label = max(causes, key=lambda cause: cause[0])
    return f"; more than allowed, {share:.3g} of it by: {label}"


def _later(shot: Electrons, terms: Sequence[ErrorTerm]) -> float:
    """Return the figure of a capture that is not all saturated, for these stages alone."""
    figures = figures_of(shot, terms)
    return figures.later if figures else 0.0


def seconds(rows: Sequence[Row], camera: str, scene: xr.Dataset) -> Seconds:
    """Return the run time of one camera's picture.

    Parameters
    ----------
    rows : rows of the ledger.
    camera : name of the camera.
    scene : scene radiance, whose attribute states its render time.
    """
    own = [
        row.seconds
        for row in rows
        if row.kind in ("radiance", "lighting", "lens")
        or row.stage in (f"sensor {camera}", f"isp {camera}")
    ]
    return Seconds(float(scene.attrs.get("rendered_s", 0.0)), sum(own))
