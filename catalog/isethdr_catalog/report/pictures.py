"""Pictures of the report: display views, false colour with its scale, labels drawn over a view."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from isethdr_core.display import display_view

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr


@dataclass(frozen=True)
class Figure:
    """A picture or a drawing with its caption; title and note are plain text."""

    title: str
    note: str = ""
    source: str = ""  # data URL of a picture
    drawing: Markup = Markup("")  # vector graphics of a plot


@dataclass(frozen=True)
class Scale:
    """A colour bar and its ticks: (position in percent, text, exponent or None)."""

    source: str
    ticks: list[tuple[float, str, int | None]]


def embedded(rgb: np.ndarray) -> str:
    """Return a data URL that holds a uint8 picture (y, x, 3) without loss, as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(rgb)).save(buffer, "PNG", compress_level=2)
    return _address(buffer, "png")


def embedded_small(rgb: np.ndarray, quality: int = 90) -> str:
    """Return a data URL of a picture as JPEG, with a quarter of the bytes of `embedded`."""
    buffer = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(rgb))
    image.save(buffer, "JPEG", quality=quality, subsampling=0)
    return _address(buffer, "jpeg")


def _address(buffer: io.BytesIO, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"


# displayed value of a scene's mean luminance before the sRGB curve: just above a middle grey
MIDDLE = 0.25
# luminance shown as white over that of the brightest surfaces; leaves room for lamps and lit signs
HEADROOM = 2.5
# least white over the median luminance, because a scene may be a single grey except for its lamps
WHITE_OVER_MEDIAN = 4.0
# least percentage of each picture's pixels that are not brighter than white; flare may cover more
BELOW_WHITE_PERCENT = 90.0


def shown_white_cd_m2(truth: np.ndarray | xr.Dataset, seen: Sequence[xr.Dataset] = ()) -> float:
    """Return the luminance that the page shows as white, cd/m2.

    It is the lesser of 2.5 times the white of the scores (`display_view.white_cd_m2`) and the
    brightest luminance, but at least four times the median; otherwise a scene of one dark grey and
    lamps would show the grey as white. In each of the pictures `seen`, at most a tenth of the
    pixels is brighter; otherwise flare around a lamp in the dark would show as a white area.

    Parameters
    ----------
    truth : reference picture, xyz (y, x, 3) or luminance (y, x), cd/m2.
    seen : pictures of cameras that are shown with the same white.
    """
    y = display_view.luminance(truth)
    white = display_view.white_cd_m2(truth)
    brightest = max(white, float(y.max()))
    of_truth = max(min(HEADROOM * white, brightest), WHITE_OVER_MEDIAN * float(np.median(y)))
    of_pictures = (
        float(np.percentile(display_view.luminance(p), BELOW_WHITE_PERCENT)) for p in seen
    )
    return max([of_truth, *of_pictures])


def compression(scene: np.ndarray | xr.Dataset, white_cd_m2: float) -> float:
    """Return the compression of the tone curve that shows the scene's mean luminance as a middle
    grey; it is at most the default of the view.

    As in an exposure meter, luminance above `white_cd_m2` counts as white in the mean. A day scene
    needs little compression and would look pale with more. In a night scene the lit road becomes
    grey and the sky stays dark.
    """
    mean = np.clip(display_view.luminance(scene) / white_cd_m2, 0.0, 1.0).mean()
    low = 0.0
    high = display_view.COMPRESSION
    for _ in range(40):  # the curve rises with its compression
        middle = (low + high) / 2
        low, high = (low, middle) if display_view.tone(mean, middle) > MIDDLE else (middle, high)
    return high


def shown(
    picture: xr.Dataset,
    white_cd_m2: float,
    caption: str,
    compressed: float = display_view.COMPRESSION,
) -> Figure:
    """Return the display view of a picture as a figure; its note states the luminance of white.

    Parameters
    ----------
    picture : picture, or (y, x, 3) array of xyz, Y in cd/m2.
    white_cd_m2 : luminance that is shown as white, cd/m2.
    caption : title of the figure.
    compressed : compression of highlights by the tone curve, as in `display_view.display`.
    """
    rgb = display_view.display(picture, white_cd_m2, compressed, natural_colour=True)
    return Figure(caption, f"white = {white_cd_m2:.3g} cd/m²", embedded(rgb))


def colour_scale(low: float, high: float) -> Scale:
    """Return the scale of the false colours, cd/m2: a bar with a tick at each decade; for less than
    two decades also at 2 and 5.
    """
    ramp, _ = display_view.false_colour(
        np.geomspace(low, high, 512)[None, :].repeat(18, 0), low, high
    )
    span = np.log10(high / low)
    steps = (1, 2, 5) if span < 2 else (1,)
    ticks = []
    for decade in np.arange(np.floor(np.log10(low)), np.log10(high) + 1e-9):
        for step in steps:
            percent = 100 * float(decade + np.log10(step) - np.log10(low)) / span
            if -1e-6 <= percent <= 100 + 1e-6:
                ticks.append((percent, *_tick(int(decade), step)))
    return Scale(embedded(ramp), ticks)


def _tick(decade: int, step: int) -> tuple[str, int | None]:
    """Return the text of `step` times a power of ten, in the form of `power`."""
    text, exponent = power(decade)
    if step == 1:
        return text, exponent
    return (f"{step * 10.0**decade:g}", None) if exponent is None else (f"{step}·10", exponent)


def power(exponent: float) -> tuple[str, int | None]:
    """Return the text of a power of ten, and the exponent if it is shown separately."""
    e = int(exponent)
    return (f"{10.0**e:g}", None) if -2 <= e <= 3 else ("10", e)


def largest_objects(objects: list[dict], instance: np.ndarray, count: int = 14) -> list[dict]:
    """Return the labelled objects with a box, largest first, without background categories and
    without boxes over half of the picture.

    Parameters
    ----------
    objects : objects of the labels; boxes are [x, y, width, height] in pixels of `instance`.
    instance : (y, x) instance numbers, for the size of the picture.
    count : largest number of objects.
    """
    area = np.prod(instance.shape)
    ground = {
        "road",
        "vegetation",
        "guard rail",
        "tunnel",
        "tree",
        "post",
        "own vehicle",
        "chart",
        "building",
    }
    boxed = [
        o
        for o in objects
        if o.get("box") and o["category"] not in ground and o["box"][2] * o["box"][3] < 0.5 * area
    ]
    return sorted(boxed, key=lambda o: -o["box"][2] * o["box"][3])[:count]


def labelled(
    xyz: xr.Dataset, white_cd_m2: float, compressed: float, labels: xr.Dataset, objects: list[dict]
) -> Figure:
    """Return a view with each object's pixels tinted, and its box and name drawn over it.

    Parameters
    ----------
    xyz : picture, or (y, x, 3) array of xyz, Y in cd/m2.
    white_cd_m2 : luminance that is shown as white, cd/m2.
    compressed : compression of highlights by the tone curve, as in `display_view.display`.
    labels : labels on the grid of the picture, with `instance` (y, x).
    objects : objects of the labels; boxes are [x, y, width, height] in pixels of `labels`.
    """
    rgb = display_view.display(xyz, white_cd_m2, compressed, natural_colour=True).astype(float)
    instance = labels["instance"].values.astype(np.int64)
    colour = np.random.default_rng(3).uniform(60, 255, (instance.max() + 1, 3))
    tinted = np.where((instance > 0)[..., None], 0.55 * rgb + 0.45 * colour[instance], rgb)
    image = Image.fromarray(tinted.astype(np.uint8))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(max(11, image.width // 70))
    for o in largest_objects(objects, instance):
        x, y, w, h = o["box"]
        draw.rectangle([x, y, x + w, y + h], outline=(255, 255, 255))
        text = f"{o['category']} {o['distance_m']:.0f} m"
        box = draw.textbbox((x, y), text, font=font, anchor="lb")
        draw.rectangle(box, fill=(0, 0, 0))
        draw.text((x, y), text, fill=(255, 255, 255), font=font, anchor="lb")
    note = "instance tint, category and distance from the camera"
    return Figure("Labels", note, embedded_small(np.asarray(image)))
