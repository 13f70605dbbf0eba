"""Demosaic methods compared: PSNR and colour difference on charts and on a stripe pattern, in
bright and dim light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core import generator
from isethdr_core.display.display_view import display, white_cd_m2
from isethdr_core.physics.colour.colour_spaces import D65_XYZ, de2000, lab
from isethdr_core.plugins.registry import build
from isethdr_core.truth import truth

if TYPE_CHECKING:
    import xarray as xr

CHARTS = {"macbeth": {}, "slanted_edge": {"contrast_ratio": 10.0}, "stripes": {}}
ARRAYS = {
    "RGGB": ("bilinear", "guided", "malvar", "menon", "learned"),
    "RG/WB": ("bilinear", "guided", "learned"),
    "WGWR/GWRW/WBWG/BWGW": ("bilinear", "guided", "learned"),
}
PITCH_UM = 3.0  # at f/2 and 16 ms a white of 100 cd/m2 fills half of the well
TILES = 4  # width of a pixel, tiles
# width of the border that is left out, pixels; methods differ in how they extend the picture there
BORDER = 8


def demosaic_methods(rows: int = 120, columns: int = 160, luminances: str = "100,1") -> list[dict]:
    """Return one row per chart, filter array, luminance and method.

    Parameters
    ----------
    rows, columns : size of the picture, pixels.
    luminances : luminances of a perfect white, cd/m2, separated by commas.

    Returns
    -------
    rows with psnr_db (of displayed sRGB, 8 bit) and ciede2000 (mean), both against the reference
    picture at the same white.
    """
    out = []
    for level in (float(v) for v in luminances.split(",")):
        for chart in CHARTS:
            mixed = radiance(chart, level, rows, columns)
            focal_mm = PITCH_UM * 1e-3 / (mixed.attrs["field_width"] / (columns + 8))
            light = build("lens", "ideal", f_number=2.0, focal_length_mm=focal_mm, falloff="none")(
                mixed
            )
            for cfa, methods in ARRAYS.items():
                shot = build(
                    "sensor", "bayer", pitch_um=PITCH_UM, cfa=cfa, rows=rows, columns=columns
                )(light, generator(seed=1))
                out += [
                    {
                        "chart": chart,
                        "luminance_cd_m2": level,
                        "cfa": cfa,
                        "demosaic": m,
                        **scored(mixed, shot, m),
                    }
                    for m in methods
                ]
    return out


def radiance(chart: str, level: float, rows: int, columns: int) -> Any:
    """Return mixed radiance of a chart. Stripes are a sine that grows finer to the right.

    Parameters
    ----------
    chart : name of the chart, a key of `CHARTS`.
    level : luminance of white, cd/m2.
    rows, columns : size of the sensor, pixels.
    """
    size = {"width": (columns + 8) * TILES, "height": (rows + 8) * TILES, "luminance_cd_m2": level}
    scene = build("scene", "uniform" if chart == "stripes" else chart, **size, **CHARTS[chart])()
    mixed = build("lighting", "weights", weights={"sky": 1.0})(scene)
    if chart == "stripes":
        x, y = np.meshgrid(np.arange(size["width"]) / TILES, np.arange(size["height"]) / TILES)
        # phase of a frequency that rises from 0.05 to 0.4 cycles per pixel
        phase = 2 * np.pi * (0.05 * x + 0.35 * x**2 / (2 * columns))
        mixed = mixed * (0.5 + 0.4 * np.sin(phase + 0.5 * y)).astype(np.float32)
        mixed.attrs = build("lighting", "weights", weights={"sky": 1.0})(scene).attrs
    return mixed


def scored(mixed: xr.DataArray, shot: Any, method: str) -> dict:
    """Return PSNR and CIEDE2000 of one shot.

    Parameters
    ----------
    mixed : mixed radiance of the chart.
    shot : captures of the chart.
    method : demosaic method of the isp.
    """
    picture = build("isp", "linear", demosaic=method)(shot)
    true = truth(mixed, picture)
    white = white_cd_m2(true)
    inner = (slice(BORDER, -BORDER), slice(BORDER, -BORDER))
    displayed, reference = (display(p, white, 0.0).astype(float)[inner] for p in (picture, true))
    difference = de2000(*(lab(p["xyz"].values[inner], white * D65_XYZ) for p in (true, picture)))
    return {
        "psnr_db": float(20 * np.log10(255 / np.sqrt(np.mean((displayed - reference) ** 2)))),
        "ciede2000": float(difference.mean()),
    }
