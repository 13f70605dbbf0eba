"""Contact sheets: one small rendering per thing, tiled into a picture, with a key."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from isethdr_core.cli.terminal import number_of
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.colour.colour_spaces import linear_srgb, srgb_encode
from isethdr_core.physics.photometry import xyz
from isethdr_core.plugins.registry import build

from ..things import Thing
from .view import ASPECT, scene_of

DAY = {"sky": 1.0}
NIGHT = {"sky": 1e-4, "headlights": 1.0, "other": 1.0, "streetlights": 1.0}
# luminance that is shown as white, relative to the luminance of the sky by day
DAY_WHITE = 0.65
NIGHT_WHITE = 3e-3
BANDS_NM = {"first_nm": 430.0, "last_nm": 670.0, "step_nm": 60.0}
COLUMNS = 8
CAPTION_PX = 13


@dataclass(frozen=True)
class Look:
    """Size, quality and appearance of the tiles."""

    width: int = 160  # width of a tile, pixels
    samples: int = 24  # samples per pixel
    night: bool = False
    quiz: bool = False  # numbers in place of names

    @property
    def height(self) -> int:
        """Return the height of a tile, pixels."""
        return round(self.width / ASPECT)


def write(things: Sequence[Thing], look: Look, out: str) -> None:
    """Render things, and write the sheet and its key, a table of number, group, family and variant.

    Parameters
    ----------
    things : one thing for each tile.
    look : size of a tile, samples per pixel, night, and whether names are hidden.
    out : picture to write, .png or .jpg; the key is written to the same folder as <name>_key.csv.

    Raises
    ------
    ConfigError
        If there is nothing to show, or `out` is not the name of a picture.
    """
    path = Path(out)
    if path.suffix.lower() not in (".png", ".jpg"):
        raise ConfigError(
            f"--out is {out!r}; expected a name that ends in .png or .jpg; type for example"
            " --out sheet.png"
        )
    if not things:
        raise ConfigError(
            "--count chooses no thing; expected 1 or more; type for example --count 24"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    tiles = [picture(thing, look) for thing in things]
    captions = [str(k) if look.quiz else f"{k} {thing.family}" for k, thing in enumerate(things, 1)]
    tiled(tiles, captions).save(path)
    key = path.with_name(path.stem + "_key.csv")
    with key.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["number", "group", "family", "variant"])
        rows.writerows([k, t.group, t.family, t.variant] for k, t in enumerate(things, 1))
    print(f"wrote {path} with {number_of(len(things), 'tile')}, and {key}")


def picture(thing: Thing, look: Look) -> np.ndarray:
    """Return one tile, (height, width, 3) 8-bit sRGB."""
    renderer = build(
        "renderer",
        "mitsuba",
        width=look.width,
        height=look.height,
        margin=0.0,
        samples=look.samples,
        max_depth=4,
        **BANDS_NM,
    )
    weights, white = (NIGHT, NIGHT_WHITE) if look.night else (DAY, DAY_WHITE)
    scene = scene_of(thing)
    demand = Demand().with_groups(group for group in scene.light_groups() if group in weights)
    light = renderer(scene, demand)
    groups = [str(group) for group in light.light_group.values]
    weight = np.array([weights[group] for group in groups])
    radiance = np.tensordot(weight, light.radiance.values, 1)
    bands = light.wavelength.values
    # A few wide bands shift colours. Dividing by the colour of the sky shows a neutral surface as
    # grey.
    sky = linear_srgb(xyz(scene.sky.at(bands), bands))
    linear = linear_srgb(xyz(radiance, bands)) / sky / white
    code = srgb_encode(np.clip(linear, 0, 1))
    return np.round(255 * code).astype(np.uint8)


def tiled(tiles: Sequence[np.ndarray], captions: Sequence[str]) -> Image.Image:
    """Return a picture of the tiles, row by row, each above its caption."""
    height, width = tiles[0].shape[:2]
    columns = min(COLUMNS, len(tiles))
    rows = -(-len(tiles) // columns)
    sheet = Image.new("RGB", (columns * width, rows * (height + CAPTION_PX)), "white")
    draw = ImageDraw.Draw(sheet)
    for k, (tile, caption) in enumerate(zip(tiles, captions)):
        x = k % columns * width
        y = k // columns * (height + CAPTION_PX)
        sheet.paste(Image.fromarray(tile), (x, y))
        draw.text((x + 3, y + height + 1), caption, fill="black")
    return sheet
