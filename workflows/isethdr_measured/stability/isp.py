"""Image processing: filters without colour differences, contradictory captures, no light and too
much light, against closed forms.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_isp.spectra import light

from isethdr_core import generator
from isethdr_core.errors import UnitError
from isethdr_core.physics.colour.colour_spaces import colour_matrix
from isethdr_core.physics.radiometry import photon_energy_j
from isethdr_core.plugins.registry import build

from .inputs import BANDS, THROUGHPUT_SR, irradiance
from .verdict import Measured, relative

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.runs.seeds import Generator

LEVEL = 100.0  # cd/m2
# relative error of raw values without a converter: float32, from which a black level is subtracted
FLOAT32 = 2.0**-22


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the class of the expected error if there is one."""
    for name in ("linear", "merge"):
        yield f"{name}: three equal filters", lambda n=name: equal_filters(n, 0.0)
        yield f"{name}: filters that differ by 1e-9", lambda n=name: equal_filters(n, 1e-9)
        yield (
            f"{name}: a filter that passes nothing",
            lambda n=name: equal_filters(n, 0.0, blind=True),
        )
        yield f"{name}: all dark", lambda n=name: dark(n)
        yield f"{name}: all saturated", lambda n=name: blinded(n)
        for shape in ((1, 1), (1, 60), (2, 2)):
            yield (
                f"{name}: {shape[0]} x {shape[1]} pixels under one filter",
                lambda n=name, s=shape: one_filter(n, *s),
            )
    yield (
        "linear: 1 x 1 pixels of a Bayer array",
        lambda: one_filter("linear", 1, 1, cfa="RGGB"),
        UnitError,
    )
    yield (
        "merge: two captures, a filter that passes nothing",
        lambda: equal_filters("merge", 0.0, blind=True, sensor="staggered"),
        UnitError,
    )
    for factor in (0.5, 2.0, 100.0):
        yield f"merge: one capture reads {factor:g} times too much", lambda f=factor: disagree(f)
    for level in (1e-9, 1e9):
        yield f"linear: {level:g} cd/m2 read back", lambda v=level: level_back(v)
    yield "matrix: samples of one colour", one_colour


def _white(level: float = LEVEL) -> np.ndarray:
    return level * light("daylight", BANDS)


def _shot(
    sensor: str = "bayer",
    shape: tuple[int, int] = (24, 24),
    level: float = LEVEL,
    generator: Generator | None = None,
    **fields: Any,
) -> xr.Dataset:
    cube = np.broadcast_to(
        (_white(level) * THROUGHPUT_SR)[:, None, None],
        (len(BANDS), 2 * shape[0] + 2, 2 * shape[1] + 2),
    )
    quiet = {} if generator else {"noise": False, "bits": 0}
    return build(
        "sensor", sensor, pitch_um=3.0, rows=shape[0], columns=shape[1], **quiet, **fields
    )(irradiance(cube, tile_um=1.5 * (1 + 1e-6)), generator)


def _picture(name: str, shot: xr.Dataset) -> xr.Dataset:
    return build("isp", name)(shot)


def _off(picture: xr.Dataset, level: float = LEVEL) -> float:
    return relative(picture.xyz.values[..., 1], level)


def equal_filters(name: str, spread: float, blind: bool = False, sensor: str = "bayer") -> Measured:
    """Check that grey in the light of the white balance is reproduced exactly with any filters, as
    the construction of the matrix demands.

    Parameters
    ----------
    name : name of the isp.
    spread : relative difference of the red and blue filter from the green one, at the ends of the
        spectrum.
    blind : whether the first filter collects nothing.
    sensor : name of the sensor.
    """
    shot = _shot(sensor, exposure_s=1e-3).copy(deep=True)
    green = shot.quantum_efficiency.values[:, 1].copy()
    white_before = [_of_white(shot, k) for k in range(3)]
    for k in (0, 2):
        shot.quantum_efficiency.values[:, k] = green * (
            1 + spread * np.linspace(-1, 1, len(BANDS)) * (k - 1)
        )
    if blind:
        shot.quantum_efficiency.values[:, 0] = 0.0
    for k in (0, 2):  # change the raw values to those of such filters
        at = shot["filter"].values == k
        ratio = _of_white(shot, k) / white_before[k]
        for raw, dark_e in zip(shot.raw.values, shot.dark_e.values):
            raw[at] = (raw[at] - dark_e) * ratio + dark_e
    return Measured(_off(_picture(name, shot)), 1e-5, "100 cd/m2, relative")


def _of_white(shot: xr.Dataset, channel: int) -> float:
    return float(shot.quantum_efficiency.values[0, channel] @ (_white() / photon_energy_j(BANDS)))


def dark(name: str) -> Measured:
    """Check that without light the mean is 0 within 5 standard errors of the reported variance."""
    picture = _picture(name, _shot(shape=(64, 64), level=0.0, generator=generator(5)))
    y = picture.xyz.values[..., 1]
    rms = np.sqrt(picture.variance.values[..., 1].mean())
    # neighbours share samples, so 4096 pixels count as 1000; fixed patterns, such as offsets of
    # columns, are a tenth of the noise
    return Measured(
        abs(float(y.mean())) / rms, 5 / np.sqrt(1000) + 0.1, "0 cd/m2, share of the noise"
    )


def blinded(name: str) -> Measured:
    """Check that with too much light no pixel is valid and all numbers are finite."""
    picture = _picture(name, _shot(level=1e12, generator=generator(5)))
    wrong = (
        picture.valid.values.mean()
        + np.mean(~np.isfinite(picture.xyz.values))
        + np.mean(~np.isfinite(picture.variance.values))
    )
    return Measured(float(wrong), 0.0, "share of pixels that pass as valid or are not finite")


def one_filter(name: str, rows: int, columns: int, cfa: str = "W") -> Measured:
    """Check that a single pixel, a single row or a few pixels are processed correctly.

    Parameters
    ----------
    name : name of the isp.
    rows, columns : size of the sensor, pixels.
    cfa : filter of all pixels.
    """
    return Measured(
        _off(_picture(name, _shot("single", (rows, columns), cfa=cfa, exposure_s=1e-3))),
        FLOAT32,
        "100 cd/m2, relative",
    )


def level_back(level: float) -> Measured:
    """Check that the picture of the ideal sensor has the luminance of the scene."""
    cube = np.broadcast_to((_white(level) * THROUGHPUT_SR)[:, None, None], (len(BANDS), 24, 24))
    return Measured(
        _off(_picture("linear", build("sensor", "ideal", pitch_um=3.0)(irradiance(cube))), level),
        FLOAT32,
        "the scene's level, relative",
    )


def disagree(factor: float) -> Measured:
    """Check that captures that contradict each other give a value between their readings."""
    shot = _shot("staggered", exposure_s=1e-3).copy(deep=True)
    shot.raw.values[1] *= factor
    y = _picture("merge", shot).xyz.values[..., 1] / LEVEL
    low = min(1.0, factor)
    high = max(1.0, factor)
    return Measured(
        max(0.0, float(y.max()) / high - 1, 1 - float(y.min()) / low),
        0.05,
        "between both readings, relative excess",
    )


def one_colour() -> Measured:
    """Check that the matrix keeps the white even if all samples are the white itself."""
    white = np.array([1.0, 2.0, 3.0])
    xyz = np.array([0.9, 1.0, 1.1])
    matrix = colour_matrix(np.tile(white, (5, 1)), np.tile(xyz, (5, 1)), white, xyz)
    return Measured(relative(matrix @ white, xyz), 1e-14, "the white's XYZ, relative")
