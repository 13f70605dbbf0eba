"""The card of a folder of pairs in Markdown: contents, units, how it was made, licence."""

from __future__ import annotations

import shlex
from typing import Any

from isethdr_core.cli.terminal import number_of
from isethdr_core.runs.provenance import versions

from .request import PairRequest
from .terms import TERMS

CARD = "README.md"


def card(request: PairRequest, first: dict[str, Any], scenes: int) -> str:
    """Return the card of a folder of pairs as Markdown.

    Parameters
    ----------
    request : the request that made the pairs.
    first : labels of one scene and camera.
    scenes : number of scenes with pairs in the folder.
    """
    own = [
        f"format={request.format}",
        f"shots={request.shots}",
        f"blur={str(request.blur).lower()}",
    ]
    command = shlex.join(["isethdr", "dataset", "pairs", request.name, *own, *request.overrides])
    used = ", ".join(f"{name} {number}" for name, number in sorted(versions().items()))
    terms = first["terms"]
    members = first["members"]
    lines = [
        f"# Pairs of {request.name}",
        "",
        f"Linear raw captures of {number_of(scenes, 'scene')} with and without parts of the light,"
        " and each part of the light separately. Every number has a physical unit.",
        "",
        "## Files",
        "",
        "One folder for each scene; in it for each camera `CAMERA.json` and"
        f" `CAMERA.{'npz' if request.format == 'numpy' else 'exr'}`. The JSON file lists the arrays"
        " with dimensions and units, and holds the objects with boxes.",
        "",
        "| array | dimensions | unit |",
        "|---|---|---|",
        *(f"| `{name}` | {row['dims']} | {row['unit']} |" for name, row in first["arrays"].items()),
        "",
        "## Terms",
        "",
        "| term | light |",
        "|---|---|",
        *(f"| `{term}` | {TERMS[term]} |" for term in terms),
        "",
        "A member is the sum of the terms up to its own, in the order of this table:",
        "",
        "| member | electrons |",
        "|---|---|",
        *(
            f"| `{member}` | {' + '.join(terms[: place + 1])} |"
            for place, member in enumerate(members)
        ),
        "",
        "- `electrons_TERM` are means of the exposure, before the full well and the converter, and"
        " may be negative: scatter takes light from the image of a lamp.",
        "- `raw_MEMBER` is the capture without noise: full well, converter, rounding."
        " `noisy_MEMBER` has shot, read and fixed-pattern noise of one device."
        " All members have the exposure of the full light.",
        "- Light electrons = (DN - `black_dn`) / `gain_dn_per_e` - `dark_e` where codes are linear;"
        " sensors that compand have a table in `of_captures`.",
        "- `xyz` and `channel_radiance` are the radiance of each pixel's line of sight, without"
        " lens. They have the noise of the renderer, `renderer_noise` by light group, relative.",
        "",
        "## How it was made",
        "",
        f"    {command}",
        "",
        f"- versions: {used}",
        "- Light of the members is computed as in a run: within `accuracy.noise_fraction_allowed`"
        " of a pixel's noise. Terms are differences of members, so they add up exactly, and each"
        " has the error of two members.",
        "",
        "## Licence",
        "",
        "The program that makes the pairs is under the MIT licence. The card of the dataset names"
        " meshes of others, if its scenes show any"
        f" (`isethdr dataset describe {request.name}`).",
        "",
    ]
    return "\n".join(lines)
