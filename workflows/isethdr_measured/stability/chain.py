"""The whole chain on charts: from the scene to the picture, against the reference picture and
against closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_isp.spectra import light
from isethdr_sensors.spectral.quantum_efficiency import quantum_efficiency

from isethdr_core import generator
from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import band_widths_nm, photon_energy_j
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import tile_pitch
from isethdr_core.truth import truth

from .lens import beyond
from .verdict import Measured, relative

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Isp, Sensor

FLOAT32 = 2.0**-21  # relative error of rounding scene, irradiance and raw to float32


def cases(slow: int = 0) -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    for decades in (1.0, 8.0, 12.0):
        yield f"ramp over {decades:g} decades, no blur", lambda d=decades: ramp(d)
    for level in (1e-9, 1.0, 1e12):
        yield f"uniform {level:g} cd/m2", lambda v=level: uniform(v)
    yield "uniform 0 cd/m2", lambda: uniform(0.0)
    for count in (3, 301):
        yield f"uniform 100 cd/m2 in {count} bands", lambda n=count: uniform(100.0, n)
    for tiles in (1.0, 0.1, 1e-3):
        yield f"disc of {tiles:g} tiles: its light", lambda t=tiles: disc(t)
        yield (
            f"disc of {tiles:g} tiles through diffraction: its light",
            lambda t=tiles: disc(t, "diffraction_limited"),
        )
    for name in ("bayer", "split_pixel", "staggered", "dual_gain", "lofic"):
        yield f"20 cd/m2 through {name} and merge: pulls", lambda n=name: pulls(n)
    yield "one tile, one pixel", lambda: uniform(100.0, shape=(1, 1)), UnitError
    if slow:
        yield "7680 x 4320 pixels", lambda: uniform(100.0, 3, (4320, 7680))


def _through(
    scene: xr.Dataset,
    lens: str = "ideal",
    sensor: Sensor | None = None,
    isp: Isp | None = None,
    noise: bool = False,
) -> tuple[xr.DataArray, xr.Dataset]:
    """Return (mixed, picture)."""
    mixed = build("lighting", "ideal")(scene)
    light = build("lens", lens, focal_length_mm=_focal_mm(mixed))(mixed)
    captures = (sensor or build("sensor", "ideal", pitch_um=3.0, cfa="W"))(
        light, generator(11) if noise else None
    )
    return mixed, (isp or build("isp", "linear"))(captures)


def _focal_mm(mixed: xr.DataArray) -> float:
    """Return the focal length at which a tile is as wide as a pixel of 3 um."""
    return 3e-3 * (1 + 1e-6) / tile_pitch(mixed, "x")


def _chart(
    name: str, shape: tuple[int, int] = (24, 48), bands: int = 31, **fields: Any
) -> xr.Dataset:
    return build(
        "scene",
        name,
        height=shape[0],
        width=shape[1],
        horizontal_field_deg=2.0 if shape[1] < 1000 else 40.0,
        step_nm=300.0 / (bands - 1),
        spectrum="E",
        **fields,
    )()


def ramp(decades: float) -> Measured:
    """Check that luminance ratios between columns are kept. They do not depend on the balance of
    the camera.
    """
    mixed, picture = _through(_chart("luminance_ramp", decades=decades))
    ratio = picture.xyz.values[..., 1] / truth(mixed, picture).xyz.values[..., 1]
    return Measured(float(np.ptp(ratio) / ratio.mean()), FLOAT32, "true ratios, relative")


def uniform(level: float, bands: int = 31, shape: tuple[int, int] = (24, 48)) -> Measured:
    """Check that a uniform field stays uniform, at its level times one known factor for the colour
    of the light.

    Parameters
    ----------
    level : luminance of the field, cd/m2.
    bands : number of wavelengths.
    shape : (rows, columns) of the chart.
    """
    mixed, picture = _through(_chart("uniform", shape, bands, luminance_cd_m2=level))
    factor = _balance_factor(mixed.wavelength.values)
    return Measured(
        relative(picture.xyz.values[..., 1], level * factor),
        FLOAT32,
        "level times the filter's own view of the light, relative",
    )


def _balance_factor(bands: np.ndarray) -> float:
    """Return Y of an equal-energy light of 1 cd/m2, as read by a clear pixel that is balanced for
    daylight.
    """
    response = (
        quantum_efficiency(build("sensor", "ideal", cfa="W").model(), bands)[0]
        * band_widths_nm(bands)
        / photon_energy_j(bands)
    )
    return float(
        response.sum()
        / luminance(np.ones(len(bands)), bands)
        / (response @ light("daylight", bands))
    )


def disc(tiles: float, lens: str = "ideal") -> Measured:
    """Check that the light of a disc of any size is its area times its luminance, less the light
    that diffraction spreads beyond the frame, which extends 36 um from its middle.

    Parameters
    ----------
    tiles : diameter of the disc, tiles.
    lens : name of the lens.
    """
    shape = (24, 48)
    level = 1e9
    pitch = 2 * math.tan(math.radians(1.0)) / shape[1]
    degrees = 2 * math.degrees(math.atan(tiles * pitch / 2))
    mixed, picture = _through(
        _chart(
            "point_lights",
            shape,
            discs=1,
            luminance_cd_m2=level,
            background_cd_m2=0.0,
            disc_diameter_deg=degrees,
        ),
        lens,
    )
    # upper bound: light of the longest wavelength that falls outside a square
    lost = beyond(36.0, 4.0 * 700 / 550) if lens != "ideal" else 0.0
    truth = level * math.pi / 4 * tiles**2 * _balance_factor(mixed.wavelength.values)
    return Measured(
        abs(float(picture.xyz.values[..., 1].sum()) / truth - 1),
        1e-5 + lost,
        "area times luminance, relative",
    )


def pulls(name: str) -> Measured:
    """Check that valid pixels scatter around their mean by the reported variance.

    A pull is a deviation over the reported standard deviation. The rms of the pulls is near 1.
    """
    scene = _chart("uniform", (64, 64), luminance_cd_m2=20.0)
    _, picture = _through(
        scene,
        sensor=build("sensor", name, cfa="W", pitch_um=3.0),
        isp=build("isp", "merge"),
        noise=True,
    )
    y = picture.xyz.values[..., 1]
    var = picture.variance.values[..., 1]
    valid = picture.valid.values
    pull = (y - y.mean()) / np.sqrt(var)
    # the rms of 4096 pulls has a standard deviation of 1.1 %; PRNU and column noise add to the
    # scatter and are not in the variance
    return Measured(
        abs(float(np.sqrt(np.mean(pull[valid] ** 2))) - 1) + (not valid.all()),
        0.1,
        "1, rms of the pulls",
    )
