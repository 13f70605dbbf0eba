"""Train the learned demosaic: ridge regression of one linear filter for each position of the array
and local class.

The training pictures are `dead_leaves` through the sensors' own filter curves, with shot and read
noise at levels from a few electrons up. No other pictures are used.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_isp.demosaic.interpolation import demosaic, plane_weights
from isethdr_isp.demosaic.learned import (
    LETTERS,
    RADIUS,
    SIDE,
    TABLE,
    cell_of,
    channels_of,
    exact,
    learned,
    neighbourhoods,
    sampled,
)
from isethdr_isp.demosaic.local_classes import COUNT, classes, local_mean
from isethdr_isp.spectra import LIGHTS, light, reflectances
from isethdr_sensors.spectral.quantum_efficiency import quantum_efficiency

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build

from .dead_leaves import dead_leaves

ARRAYS = ("RG/GB", "RG/WB", "WGWR/GWRW/WBWG/BWGW")
RECIPE = {
    "pictures": 80,
    "side_px": 160,
    "seed": 2017,
    "peak_e": [3.0, 30000.0],
    "read_noise_e": [0.5, 10.0],
    "ridge": 3e-4,
    "weight": "1 / (local variance + 1e-3 local mean^2)",
    "scene": (
        "dead leaves, 73 smooth reflectances in daylight, halogen, LED and sodium light, shapes and"
        " stripes by formula"
    ),
    "sensor": "filter curves of sensor=bayer with the array in place",
    "version": 1,
}


def train_demosaic(
    path: str = "", pictures: int = RECIPE["pictures"], arrays: str = ",".join(ARRAYS)
) -> list[dict]:
    """Train the filters of `isp.demosaic=learned` again, for every filter array.

    Parameters
    ----------
    path : file to write; empty replaces the filters of the installed isp.
    pictures : number of pictures per array; numbers other than the recipe's are for trials.
    arrays : cells of filter arrays, separated by commas.

    Returns
    -------
    rows with cfa, filters (number), samples (training pixels), bilinear_error and learned_error
    (rms errors of bilinear and learned planes on pictures of another seed, relative to the
    noise-free mean), recipe (first digits of its hash), bytes (of the file).

    Raises
    ------
    ConfigError : the file cannot be made, there is no picture, an array has no known filters, or
        filters that are not those of the recipe would replace the installed ones.
    """
    recipe = {**RECIPE, "pictures": pictures}
    names = [name.strip() for name in arrays.split(",")]
    check(path, pictures, names)
    tables = {cell: trained(cell, recipe) for cell in names}
    stored = {cell: table.astype(np.float16) for cell, table in tables.items()}
    path = Path(path) if path else TABLE
    np.savez_compressed(
        path, provenance=json.dumps({"recipe": recipe, "sha256": recipe_hash(recipe)}), **stored
    )
    rows = []
    for cell in names:
        plain, ours = held_out({cell: exact(stored[cell].astype(float), cell)}, cell, recipe)
        rows.append(
            {
                "cfa": cell,
                "filters": int(np.prod(stored[cell].shape[:4])),
                "samples": pictures * recipe["side_px"] ** 2,
                "bilinear_error": plain,
                "learned_error": ours,
                "recipe": recipe_hash(recipe)[:8],
                "bytes": path.stat().st_size,
            }
        )
    return rows


def check(path: str, pictures: int, arrays: Sequence[str]) -> None:
    """Check the settings of a training before its work.

    Parameters
    ----------
    path : file to write; empty: that of the installed isp.
    pictures : number of pictures per array.
    arrays : cells of filter arrays.

    Raises
    ------
    ConfigError : the file cannot be made, there is no picture, an array has no known filters, or
        filters that are not those of the recipe would replace the installed ones.
    """
    if pictures < 1:
        raise ConfigError(f"pictures is {pictures}; expected 1 or more; type pictures=80")
    for cell in arrays:
        _check_array(cell)
    if path and not (path.endswith(".npz") and Path(path).resolve().parent.is_dir()):
        raise ConfigError(
            f"path is {path!r}; expected a file that ends in .npz, in a folder that exists; type"
            " for example path=filters.npz"
        )
    if not path and (pictures != RECIPE["pictures"] or set(arrays) != set(ARRAYS)):
        raise ConfigError(
            f"filters of {pictures} pictures for {', '.join(arrays)} would replace all filters of"
            " the installed isp; expected the recipe's pictures and arrays; type for example"
            " path=trial.npz"
        )


def _check_array(cell: str) -> None:
    """Raise ConfigError unless a cell has rows of equal length with letters of known filters."""
    rows = cell.split("/")
    if not rows[0] or {len(row) for row in rows} != {len(rows[0])} or set(cell) - {"/", *LETTERS}:
        raise ConfigError(
            f"arrays has {cell!r}; expected rows of equal length, separated by /, with the letters"
            f" {', '.join(LETTERS)}; type for example arrays={ARRAYS[0]}"
        )


def recipe_hash(recipe: dict) -> str:
    """Return the SHA-256 of a recipe, written as JSON with sorted keys."""
    return hashlib.sha256(json.dumps(recipe, sort_keys=True).encode()).hexdigest()


def trained(cell: str, recipe: dict) -> np.ndarray:
    """Return the trained filters (row, column, class, channel, tap) of one array.

    Parameters
    ----------
    cell : letters of the filter array.
    recipe : settings of the training, as in `RECIPE`.
    """
    tile = cell_of(cell)
    channels = channels_of(cell)
    taps = sampled(cell)
    size = taps.shape[-1]
    gram = np.zeros((*tile.shape, COUNT, size, size))
    cross = np.zeros((*tile.shape, COUNT, size, len(channels)))
    for number in range(recipe["pictures"]):
        planes, mosaic, filters, variance = example(cell, recipe, number)
        kinds = classes(mosaic, filters, variance)
        near = neighbourhoods(mosaic, tile.shape)
        # errors are weighted in units of the local noise, or of the local signal if there is little
        # noise
        weight = 1 / (local_mean(variance) + 1e-3 * local_mean(mosaic) ** 2)
        for y, x in np.ndindex(tile.shape):
            at = np.s_[y :: tile.shape[0], x :: tile.shape[1]]
            samples = near[at].reshape(-1, size)
            target = planes[(slice(None), *at)].reshape(len(channels), -1).T
            kind = kinds[at].ravel()
            w = weight[at].ravel()
            for k in np.unique(kind):
                some = samples[kind == k]
                scaled = some.T * w[kind == k]
                gram[y, x, k] += scaled @ some
                cross[y, x, k] += scaled @ target[kind == k]
    return solved(gram, cross, taps, base_filters(cell), recipe["ridge"])


def solved(gram: np.ndarray, cross: Any, taps: Any, base: Any, ridge: float) -> np.ndarray:
    """Return the filters that minimise the error plus a ridge penalty for the distance from `base`.
    They keep the sums of `learned.exact`.

    Parameters
    ----------
    gram : (row, column, class, tap, tap) weighted sums of tap times tap.
    cross : (row, column, class, tap, channel) weighted sums of tap times target.
    taps : (row, column, channel, tap) the taps of each channel at each position of the array; the
        sums of a filter over them are kept.
    base : (row, column, channel, tap) filters that the ridge penalty favours.
    ridge : weight of the distance from `base`, relative to the mean of `gram`.
    """
    filters = np.empty((*gram.shape[:3], *base.shape[2:]))
    for y, x in np.ndindex(gram.shape[:2]):
        # basis of the changes of a filter that keep all sums
        free = np.linalg.svd(taps[y, x].astype(float))[2][len(taps[y, x]) :].T
        for k in range(gram.shape[2]):
            g = free.T @ gram[y, x, k] @ free
            g += (ridge * np.trace(g) / len(g) + 1e-9) * np.eye(len(g))
            lacking = free.T @ (cross[y, x, k] - gram[y, x, k] @ base[y, x].T)
            filters[y, x, k] = base[y, x] + (free @ np.linalg.solve(g, lacking)).T
    return filters


def base_filters(cell: str) -> np.ndarray:
    """Return the bilinear filters (row, column, channel, tap), which are used for classes without
    training samples.
    """
    taps = sampled(cell)
    out = np.zeros(taps.shape)
    for place in np.ndindex(taps.shape[:3]):
        for dy, dx, weight in plane_weights(taps[place].reshape(SIDE, SIDE)):
            out[place][(dy + RADIUS) * SIDE + dx + RADIUS] = weight
    return out


def example(cell: str, recipe: dict, number: int) -> tuple[Any, Any, np.ndarray, Any]:
    """Return a training picture: noise-free planes (channel, y, x), a noisy mosaic (y, x), both in
    electrons, the channel of each pixel (y, x), and the variance of the mosaic, electrons squared.

    Parameters
    ----------
    cell : letters of the filter array.
    recipe : seed, side in pixels, and ranges of peak electrons and read noise.
    number : number of the picture, which seeds the random numbers together with the recipe's seed.
    """
    rng = np.random.default_rng([recipe["seed"], number])
    side = recipe["side_px"]
    tile = cell_of(cell)
    channels = channels_of(cell)
    planes = dead_leaves(side, side, colours(cell, rng), rng)
    planes = planes * np.exp(rng.uniform(*np.log(recipe["peak_e"])))
    index = np.vectorize(channels.index)(tile)
    filters = np.tile(index, (side // len(tile) + 1, side // len(tile[0]) + 1))[:side, :side]
    mean = np.take_along_axis(planes, filters[None], 0)[0]
    read = np.exp(rng.uniform(*np.log(recipe["read_noise_e"])))
    mosaic = rng.poisson(mean) + read * rng.standard_normal(mean.shape)
    return planes, mosaic, filters, np.maximum(mosaic + read**2, 0.1 * read**2)


def colours(cell: str, rng: np.random.Generator) -> np.ndarray:
    """Return electrons (surface, channel) of smooth reflectances in one of the four lights. Most
    are made paler at random.

    Parameters
    ----------
    cell : letters of the filter array.
    rng : generator of the random numbers.
    """
    response = curves(cell)
    lit = reflectances(WAVELENGTH_NM) * light(LIGHTS[rng.integers(len(LIGHTS))], WAVELENGTH_NM)
    electrons = lit @ response.T
    grey = electrons[:1]  # the first reflectance is a grey
    # squared, because most things are nearly grey
    pale = rng.uniform(0.0, 1.0, (len(electrons), 1)) ** 2
    return pale * electrons + (1 - pale) * grey * (electrons.mean(1, keepdims=True) / grey.mean())


WAVELENGTH_NM = np.arange(400.0, 701.0, 10.0)


def curves(cell: str) -> np.ndarray:
    """Return electrons per energy (channel, wavelength) behind the simulated camera's filters, on
    any scale.
    """
    return (
        quantum_efficiency(build("sensor", "bayer", cfa=cell).model(), WAVELENGTH_NM)
        * WAVELENGTH_NM
    )


def held_out(table: dict, cell: str, recipe: dict, pictures: int = 6) -> tuple[float, float]:
    """Return the rms errors of bilinear and learned planes on pictures of another seed, relative to
    the mean of each plane.

    Parameters
    ----------
    table : {cell: filters}.
    cell : letters of the filter array.
    recipe : recipe of the training; its seed plus 1 makes the pictures.
    pictures : number of pictures.
    """
    channels = channels_of(cell)
    errors = []
    for number in range(pictures):
        planes, mosaic, filters, variance = example(
            cell, {**recipe, "seed": recipe["seed"] + 1}, number
        )
        plain = demosaic(mosaic, filters, len(channels))[0]
        for demosaiced in (plain, learned(mosaic, filters, channels, variance, table)):
            errors.append(
                np.mean(((demosaiced - planes) / planes.mean((1, 2), keepdims=True)) ** 2)
            )
    return tuple(float(np.sqrt(np.mean(errors[k::2]))) for k in (0, 1))
