"""What a notebook shows of a run: pictures, scores with intervals, seconds and paths."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape
from PIL import Image

from ..display import display_view

if TYPE_CHECKING:
    from ..runs.run import Result

WIDEST = 480  # largest width and height of a picture in a notebook, pixels


def html_of(result: Result) -> str:
    """Return a run as HTML: its pictures in the display view, and the scores of the frame."""
    scores: dict[str, dict[str, str]] = {}
    for score in result.scores:
        if not score["object"]:
            unit = f", {score['unit']}" if score["unit"] else ""
            scores.setdefault(f"{score['metric']}{unit}", {})[score["camera"]] = value_text(score)
    rows = [[name, *(cells.get(c, "") for c in result.cameras)] for name, cells in scores.items()]
    name = f" {result.labels.name}" if result.labels.name else ""
    seconds = sum(row.seconds for row in result.ledger)
    return Markup("<div><p><b>run{} {}</b>, {} s</p>{}{}<p><code>{}</code></p></div>").format(
        name,
        result.key,
        f"{seconds:.1f}",
        pictures(result),
        table(["score", *result.cameras], rows),
        result.path,
    )


def pictures(result: Result) -> Markup:
    """Return the picture of each camera, with the white of the camera's reference picture."""
    shown = Markup("")
    for camera in result.cameras:
        white = display_view.white_cd_m2(result.open(f"truth/{camera}"))
        image = Image.fromarray(display_view.display(result.open(f"picture/{camera}"), white))
        image.thumbnail((WIDEST, WIDEST))
        buffer = io.BytesIO()
        image.save(buffer, "PNG")
        shown += Markup(
            '<figure style="display:inline-block;margin:0 8px 8px 0">'
            '<img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{0}</figcaption></figure>'
        ).format(camera, base64.b64encode(buffer.getvalue()).decode())
    return shown


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> Markup:
    """Return an HTML table of escaped cells."""
    first = Markup("").join(Markup("<th>{}</th>").format(cell) for cell in head)
    body = Markup("").join(
        Markup("<tr>{}</tr>").format(
            Markup("").join(Markup("<td>{}</td>").format("" if c is None else c) for c in row)
        )
        for row in rows
    )
    return Markup("<table><thead><tr>{}</tr></thead><tbody>{}</tbody></table>").format(first, body)


def value_text(score: Mapping[str, Any]) -> str:
    """Return a value, with half the width of its 95 % interval if it has one."""
    low = score["low"]
    high = score["high"]
    has_interval = low is not None and high is not None and 0 < high - low < math.inf
    half = f" ± {(high - low) / 2:.1g}" if has_interval else ""
    return str(escape(f"{score['value']:.4g}{half}"))
