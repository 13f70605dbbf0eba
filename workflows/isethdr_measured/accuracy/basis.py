"""Functionals of the spectrum in place of bands, against long double sums over tiles and bands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics.imaging.field_optics import field_optics
from isethdr_optics.imaging.photocurrent import FUNCTIONALS
from isethdr_optics.plan.planning import complete_plan
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import ledger, quantities
from isethdr_core.demand import Demand
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.pipeline.imaging_plan import imaged
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty.budget import Allowed

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Flare, Lens

SHAPE = (48, 64)  # (rows, columns) tiles of the frame
TILE = 0.0005  # width of a tile, tangents of the field angle
BANDS_NM = np.arange(400.0, 701.0, 10.0)
ALLOWED = (1.0, 0.1, 0.01)  # errors allowed, standard deviations of the noise
ROAD = 4e-6  # radiance of the road, W m-2 sr-1 nm-1
LAMP = 1e8  # radiance of the lamps over that of the road
PIXELS = 200  # number of tiles at which long double sums are taken


def measured() -> list[Work]:
    """Return one diagram: largest error of a tile's electrons in standard deviations of the noise,
    against the noise allowed.
    """
    return [
        against_bands(
            "basis",
            build("lens", "diffraction_limited", focal_length_mm=6.0),
            (build("flare", "aperture"),),
            SHAPE,
        )
    ]


def against_bands(stage: str, lens: Lens, flares: Sequence[Flare], shape: tuple[int, int]) -> Work:
    """Return the diagram of a lens with flares: functionals for several errors allowed, and the
    computation band by band. The kernels are computed in advance and not timed.

    Parameters
    ----------
    stage : title of the diagram.
    lens : lens under test.
    flares : flare models in the lens.
    shape : (rows, columns) tiles of the scene.
    """
    mixed = night(shape)
    response = build("sensor", "bayer", pitch_um=3.0).narrow(Demand()).response
    # also makes the kernels, which every setting shares
    rows, columns, truth = direct(mixed, lens, flares, response)
    noise = np.sqrt(np.maximum(truth, 0) + response.read_noise_e**2)
    points = []

    def point(name: str, make: Callable[..., Any], mark: str = "") -> None:
        light, cpu_s, peak_mb = timed(make)
        points.append(
            Point(name, worst(light, rows, columns, truth, noise, response), cpu_s, peak_mb, mark)
        )

    for allowed in ALLOWED:
        allowed_response = replace(response, noise_fraction_allowed=allowed)
        with ledger.stage(ledger.Ledger(), "lens") as row:
            imaged(complete_plan(lens, flares, mixed, allowed_response), mixed)
        counts = [e.label.split(" ")[0] for e in row.errors if e.source.key == FUNCTIONALS]
        name = f"{counts[0]} functionals" if counts else "band by band"
        point(
            f"{allowed:g} allowed: {name}",
            lambda asked=allowed_response: complete_plan(lens, flares, mixed, asked).image(mixed),
            "default" if allowed == Allowed.noise_fraction else "",
        )
    point("band by band, exact", lambda: lens(mixed, flares), "peer")
    relative = response.error_allowed
    point(
        f"band by band, {relative:.2g} allowed", lambda: lens(mixed, flares, error_allowed=relative)
    )
    return Work(
        stage,
        "largest error of a tile's electrons, standard deviations of the noise",
        f"long double sums at {PIXELS} tiles",
        1e-7,
        points,
    )


def night(shape: tuple[int, int]) -> xr.DataArray:
    """Return mixed radiance (wavelength, y, x) of daylight and sodium light on grey and coloured
    tiles, with two lamps 1e8 times as bright.
    """
    rng = np.random.default_rng(0)
    nm = BANDS_NM[:, None, None]
    led = np.exp(-0.5 * ((nm - 450) / 9) ** 2) + 0.7 * np.exp(-0.5 * ((nm - 560) / 55) ** 2)
    sodium = np.exp(-0.5 * ((nm - 589) / 6) ** 2) + 0.02
    day = 1.5 - nm / 700
    paint = 0.1 + 0.5 * np.exp(-0.5 * ((nm - rng.choice([430, 500, 570, 660], shape)) / 40) ** 2)
    cube = paint * (sodium * rng.uniform(0.2, 2, shape) + day * rng.uniform(0.2, 2, shape)) * ROAD
    cube[:, 10:13, 15:18] += LAMP * ROAD * sodium
    cube[:, 22:25, 35:38] += LAMP * ROAD * led
    y, x = (quantities.centres(n, n * TILE) for n in shape)
    return quantities.plane(cube.astype(np.float32), BANDS_NM, x, y, quantities.RADIANCE)


def counting(response: np.ndarray) -> Any:
    """Return electrons (channel, band) of the most sensitive photodiode in one exposure, per W m-2
    nm-1 of irradiance.
    """
    return (
        response.efficiency(BANDS_NM) * photons_per_energy(BANDS_NM) * response.area_exposure_m2_s
    )


def direct(
    mixed: xr.DataArray, lens: Lens, flares: Sequence[Flare], response: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Any]:
    """Return rows and columns of some tiles, and their electrons (channel, tile). Every tile and
    band is summed in long double.

    Parameters
    ----------
    mixed : (wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    lens : lens under test.
    flares : flare models in the lens.
    response : response of the sensor to light.
    """
    field = field_optics(lens, mixed, flares)
    rng = np.random.default_rng(1)
    height, width = mixed.shape[1:]
    rows = rng.integers(0, height, PIXELS)
    columns = rng.integers(0, width, PIXELS)
    light = mixed.values * (1.0 if field.relative is None else field.relative)
    sums = np.zeros((len(mixed), PIXELS), np.longdouble)
    for b, kernel in enumerate(field.kernels.bands):
        flipped = kernel[::-1, ::-1].astype(np.longdouble)
        for k, (y, x) in enumerate(zip(rows, columns)):
            top = kernel.shape[0] // 2 - y
            left = kernel.shape[1] // 2 - x
            sums[b, k] = (
                flipped[top : top + height, left : left + width] * light[b]
            ).sum() * field.gains[b]
    return rows, columns, (counting(response) @ sums).astype(float)


def worst(
    light: xr.DataArray,
    rows: Sequence[dict[str, Any]],
    columns: int,
    truth: Any,
    noise: np.ndarray,
    response: np.ndarray,
) -> float:
    """Return the largest error over the noise, at tiles below full scale.

    Parameters
    ----------
    light : ([channel or wavelength], y, x) photocurrent or irradiance on the sensor plane.
    rows, columns : (tile,) row and column numbers of the compared tiles.
    truth : (channel, tile) electrons of the reference.
    noise : (channel, tile) standard deviation of the sensor's noise, electrons.
    response : response of the sensor to light.
    """
    at = light.values[:, rows, columns].astype(float)
    if "channel" in light.dims:
        electrons = at * response.area_exposure_m2_s
    else:
        electrons = counting(response) @ at
    _, first = np.unique(response.efficiency(BANDS_NM), axis=0, return_index=True)
    reference = truth[np.sort(first)] if len(electrons) < len(truth) else truth
    scale = noise[np.sort(first)] if len(electrons) < len(truth) else noise
    return float(
        np.max(
            np.where(reference < response.full_scale_e, np.abs(electrons - reference) / scale, 0.0)
        )
    )
