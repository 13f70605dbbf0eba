"""Common parts of the paper's figures: a rendered scene with its lens and dirt, and sheets of
labelled pictures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from isethdr_core import generator
from isethdr_core.config.composition import compose
from isethdr_core.display.display_view import display
from isethdr_core.extras import needed
from isethdr_core.ledger import Ledger
from isethdr_core.physics.photometry import luminance
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.truth import labels_on, truth

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from isethdr_core.pipeline.chain import Chain
    from isethdr_core.plugins.protocols import Isp, Lighting, Sensor


def rendered(*overrides: Any) -> tuple[Chain, xr.Dataset]:
    """Return (chain, scene radiance) of a composed config. Radiance is read from its store, and
    rendered only if it is missing.
    """
    config = compose(list(overrides))
    rows = Ledger()
    built = chain(config)
    return built, scene_radiance(built, plan(built, rows), rows, config)[0]


def through(built: Any, scene: xr.Dataset, lighting: Lighting, **lens: Any) -> tuple[Any, Any]:
    """Return (mixed radiance, irradiance) of a scene through the chain's lens with its flares.

    Parameters
    ----------
    built : components of the run.
    scene : scene radiance.
    lighting : lighting component.
    lens : changed fields of the lens, by name.
    """
    mixed = lighting(scene)
    return mixed, replace(built.lens, **lens)(mixed, flares=tuple(built.flares.values()))


def seen_by(
    sensor: Sensor,
    isp: Isp,
    mixed: xr.DataArray,
    light: xr.DataArray,
    scene: xr.Dataset,
    seed: int = 0,
) -> tuple[Any, Any, xr.Dataset, xr.Dataset]:
    """Return (captures, picture, truth, labels) of one shot.

    Parameters
    ----------
    sensor : sensor of the camera.
    isp : isp of the camera.
    mixed : mixed radiance.
    light : irradiance on the sensor plane.
    scene : scene radiance with its labels.
    seed : seed of the noise.
    """
    shot = sensor(light, generator(seed=seed))
    picture = isp(shot)
    return shot, picture, truth(mixed, picture), labels_on(scene, picture)


def write_sheet(
    path: str, rows: list[list], names: list[list[str]], plot: Callable[..., Any] | None = None
) -> None:
    """Write a sheet with rows of titled pictures, and a drawing below them.

    Parameters
    ----------
    path : file of the sheet.
    rows : rows of pictures, each (y, x, 3) bytes.
    names : titles of the pictures, row by row.
    plot : function(axes) that draws below the pictures; None: no drawing.
    """
    with needed("a drawing", extra="report"):
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot as plt

    columns = max(map(len, rows))
    high, wide = rows[0][0].shape[:2]
    fig = plt.figure(
        figsize=(
            4.2 * columns,
            4.2 * high / wide * len(rows) + 0.3 * len(rows) + (3.2 if plot else 0),
        ),
        layout="constrained",
    )
    grid = fig.add_gridspec(
        len(rows) + bool(plot),
        columns,
        height_ratios=[high / wide * 4.2 + 0.3] * len(rows) + [3.2] * bool(plot),
    )
    for r, (pictures, texts) in enumerate(zip(rows, names)):
        for c, (picture, text) in enumerate(zip(pictures, texts)):
            axes = fig.add_subplot(grid[r, c])
            axes.imshow(picture)
            axes.set_title(text, fontsize=9)
            axes.axis("off")
    if plot:
        plot(fig.add_subplot(grid[-1, :]))
    fig.savefig(
        path,
        dpi=100,
        **({"pil_kwargs": {"quality": 85}} if str(path).endswith((".jpg", ".jpeg")) else {}),
    )
    plt.close(fig)


def lux_of(light: xr.DataArray) -> np.ndarray:
    """Return the illuminance (y, x), lux, float64, of an irradiance."""
    return luminance(light.values.astype(float), light.wavelength.values)


def shown(picture: xr.Dataset, white_cd_m2: float) -> np.ndarray:
    """Return a picture in sRGB bytes with a given white. It is not scaled by its own maximum."""
    return display(picture, white_cd_m2)


def thinned(picture: np.ndarray, widest: int = 900) -> np.ndarray:
    """Return every n-th pixel of a picture, so that it is at most `widest` pixels wide."""
    step = -(-picture.shape[1] // widest)
    return picture[::step, ::step]
