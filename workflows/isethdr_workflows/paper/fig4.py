"""Flare of apertures with different numbers of blades and densities of dirt, for five lights, each
ten times dimmer than the previous one: a table and a sheet of pictures.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from isethdr_core.display.display_view import false_colour
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build

from ..study_command import RASTERS, check_picture

BLADES = (4, 5, 6, 8, 0)  # numbers of blades; 0 is a round aperture
DIRT = {  # assumed densities: dust grains and scratches per mm2 of the pupil
    "dense": (120.0, 40.0),
    "some": (40.0, 12.0),
    "little": (10.0, 3.0),
    "none": (0.0, 0.0),
}
FOCAL_MM = 4.38
F_NUMBER = 2.8
PITCH_UM = 6.0
BANDS = {"first_nm": 430.0, "last_nm": 670.0, "step_nm": 40.0}
DECADES = 8  # range of the false colours, down from the brightest tile
MARGIN = 3  # number of white tiles between cells
RING = 8  # distance from a disc to the ring around it, tiles
# smallest size of a cell that holds the rings of five discs, tiles
LEAST_WIDTH = 100
LEAST_HEIGHT = 2 * RING


def paper_fig4(picture: str = "", width: int = 240, height: int = 135) -> list[dict]:
    """Repeat figure 4 of the ISETHDR paper: flare of five lights by iris and density of dirt.

    Parameters
    ----------
    picture : file for the sheet of log false colour (png or jpg); empty writes none.
    width, height : tiles of one cell.

    Returns
    -------
    rows with dirt, blades, dust_per_mm2, scratches_per_mm2, transmitted (light over that of the
    open round aperture), lux_peak, lux_median (flare in the dark), decades between the two, and
    discs_seen (how many of the five discs have more than twice the median of the ring around them).

    Raises
    ------
    ConfigError : a cell is too small for the rings around the discs, or the picture cannot be
        written.
    """
    check_picture(picture, RASTERS)
    if width < LEAST_WIDTH or height < LEAST_HEIGHT:
        raise ConfigError(
            f"study paper_fig4 has width={width} height={height}; expected at least"
            f" {LEAST_WIDTH} x {LEAST_HEIGHT} tiles; type width=120 height=67"
        )
    mixed = lights(width, height)
    lens = build(
        "lens", "diffraction_limited", f_number=F_NUMBER, focal_length_mm=FOCAL_MM, falloff="none"
    )
    rows = []
    cells = []
    for dirt, (dust, scratches) in DIRT.items():
        for blades in BLADES:
            flare = build(
                "flare", "aperture", blades=blades, dust_per_mm2=dust, scratches_per_mm2=scratches
            )
            light = lens(mixed, flares=(flare,))
            lux = luminance(light.values.astype(float), light.wavelength.values)
            cells.append(lux)
            rows.append(
                {
                    "dirt": dirt,
                    "blades": str(blades or "circle"),
                    "dust_per_mm2": dust,
                    "scratches_per_mm2": scratches,
                    "transmitted": float(light.attrs["throughput_sr"]) / lens.throughput_sr(),
                    **figures(lux),
                }
            )
    if picture:
        write_sheet(picture, cells)
    return rows


def lights(width: int, height: int) -> Any:
    """Return mixed radiance of five discs of 1e6 to 1e2 cd/m2 on a background of 1e-3 cd/m2. A tile
    is `PITCH_UM` wide on the sensor.

    Parameters
    ----------
    width, height : tiles of one cell.
    """
    field = np.degrees(2 * np.arctan(width * PITCH_UM * 1e-3 / FOCAL_MM / 2))
    scene = build(
        "scene",
        "point_lights",
        width=width,
        height=height,
        horizontal_field_deg=float(field),
        background_cd_m2=1e-3,
        disc_diameter_deg=0.4,
        **BANDS,
    )()
    return build("lighting", "weights", weights={"headlights": 1.0, "sky": 1.0})(scene)


def figures(lux: np.ndarray) -> dict:
    """Return the figures of one cell from its illuminance (y, x), lux."""
    height, width = lux.shape
    visible = 0
    for k in range(5):
        x = int((k + 0.5) * width / 5)
        disc = lux[height // 2 - 1 : height // 2 + 2, x - 1 : x + 2].mean()
        ring = np.concatenate(
            [lux[height // 2 - RING : height // 2 + RING, x + d].ravel() for d in (-RING, RING)]
        )
        visible += bool(disc > 2 * np.median(ring))
    peak = float(lux.max())
    dark = float(np.median(lux))
    return {
        "lux_peak": peak,
        "lux_median": dark,
        "decades": float(np.log10(peak / dark)),
        "discs_seen": visible,
    }


def write_sheet(path: str, cells: list) -> None:
    """Write the cells as one picture, with one row per density of dirt. All cells share one
    logarithmic scale.

    Parameters
    ----------
    path : file of the picture.
    cells : (y, x) illuminance of each cell, lux, row by row.
    """
    from PIL import Image

    top = max(float(c.max()) for c in cells)
    height, width = cells[0].shape
    columns = len(BLADES)
    step_y = height + MARGIN
    step_x = width + MARGIN
    sheet = np.full((len(DIRT) * step_y - MARGIN, columns * step_x - MARGIN, 3), 255, np.uint8)
    for number, lux in enumerate(cells):
        y = number // columns * step_y
        x = number % columns * step_x
        sheet[y : y + height, x : x + width] = false_colour(lux, top * 10.0**-DECADES, top)[0]
    Image.fromarray(sheet).save(path, quality=88)
