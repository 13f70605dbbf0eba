"""Pictures of the report: display views, false colour with its scale, labels drawn over a view."""

from __future__ import annotations

import base64
import io
from html import escape

import numpy as np

from isethdr_core import view


def embedded(rgb: np.ndarray, alt: str, quality: int = 90) -> str:
    """Return an <img> that carries a uint8 picture (y, x, 3) inside itself."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(rgb)).save(buffer, "JPEG", quality=quality, subsampling=0)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{escape(alt)}" src="data:image/jpeg;base64,{data}">'


def figure(content: str, caption: str) -> str:
    """Return content with a caption below; the caption is HTML."""
    return f"<figure>{content}<figcaption>{caption}</figcaption></figure>"


MIDDLE = 0.4    # displayed value, before the sRGB curve, of a scene's median: a middle grey


def compression(scene, white_cd_m2: float) -> float:
    """Return the tone curve's compression that shows the scene's median as a middle grey, at most the view's default.

    A day needs little of it and would look pale with more; a night takes all there is.
    """
    median = np.median(view.luminance(scene)) / white_cd_m2
    low, high = 0.0, view.COMPRESSION
    for _ in range(40):     # the curve rises with its compression
        middle = (low + high) / 2
        low, high = (low, middle) if view.tone(median, middle) > MIDDLE else (middle, high)
    return high


def shown(picture, white_cd_m2: float, caption: str, compressed: float = view.COMPRESSION) -> str:
    """Return the display view of a picture or of xyz, with the luminance that is shown as white."""
    rgb = view.display(picture, white_cd_m2, compressed)
    return figure(embedded(rgb, caption), f"<b>{escape(caption)}</b> white = {white_cd_m2:.3g} cd/m<sup>2</sup>")


def false_colour(picture, low: float, high: float, caption: str) -> str:
    """Return luminance in false colour between `low` and `high` cd/m2, to be read with `colour_scale`."""
    rgb, _ = view.false_colour(picture, low, high)
    return figure(embedded(rgb, caption), f"<b>{escape(caption)}</b>")


def colour_scale(low: float, high: float) -> str:
    """Return the scale of the false colours: a bar with one tick per decade, cd/m2."""
    ramp, _ = view.false_colour(np.geomspace(low, high, 512)[None, :].repeat(18, 0), low, high)
    decades = np.arange(np.ceil(np.log10(low) - 1e-9), np.floor(np.log10(high) + 1e-9) + 1)
    span = np.log10(high / low)
    ticks = "".join(f'<span style="left:{100 * (d - np.log10(low)) / span:.2f}%">{power(d)}</span>' for d in decades)
    return f'<div class=scale>{embedded(ramp, "scale", 95)}<div class=ticks>{ticks}</div><div>luminance, cd/m<sup>2</sup></div></div>'


def power(exponent: float) -> str:
    """Return a power of ten as people read it."""
    e = int(exponent)
    return f"{10.0**e:g}" if -2 <= e <= 3 else f"10<sup>{e}</sup>"


def largest_objects(objects: list[dict], instance, count: int = 14) -> list[dict]:
    """Return the labelled things with a box, largest first, leaving out what spans the whole picture."""
    area = np.prod(instance.shape)
    ground = {"road", "vegetation", "guard rail", "tunnel", "tree", "post", "own vehicle", "chart", "building"}
    seen = [o for o in objects if o.get("box") and o["category"] not in ground and o["box"][2] * o["box"][3] < 0.5 * area]
    return sorted(seen, key=lambda o: -o["box"][2] * o["box"][3])[:count]


def labelled(xyz, white_cd_m2: float, labels, objects: list[dict]) -> str:
    """Return a view with each object's pixels tinted, and its box and name drawn over it.

    `objects` hold boxes [x, y, width, height] in the pixels of `labels`.
    """
    from PIL import Image, ImageDraw, ImageFont

    rgb = view.display(xyz, white_cd_m2).astype(float)
    instance = labels["instance"].values.astype(np.int64)
    colour = np.random.default_rng(3).uniform(60, 255, (instance.max() + 1, 3))
    tinted = np.where((instance > 0)[..., None], 0.55 * rgb + 0.45 * colour[instance], rgb)
    image = Image.fromarray(tinted.astype(np.uint8))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(max(11, image.width // 70))
    for o in largest_objects(objects, instance):
        x, y, w, h = o["box"]
        draw.rectangle([x, y, x + w, y + h], outline=(255, 255, 255))
        text = f"{o['category']} {o['distance_m']:.0f} m"
        box = draw.textbbox((x, y), text, font=font, anchor="lb")
        draw.rectangle(box, fill=(0, 0, 0))
        draw.text((x, y), text, fill=(255, 255, 255), font=font, anchor="lb")
    return figure(embedded(np.asarray(image), "labels"), "<b>Labels</b> instance tint, category and distance from the camera")
