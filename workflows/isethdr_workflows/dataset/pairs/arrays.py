"""Arrays and labels of one scene and one camera, as they are written."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .exposures import Shots
from .reference import CHANNEL_RADIANCE

# figures of a capture that are needed to compute electrons from DN
OF_CAPTURE = (
    "exposure_s",
    "gain_dn_per_e",
    "black_dn",
    "top_dn",
    "read_noise_e",
    "dark_e",
    "quantisation_e",
    "area_m2",
    "companding_linear_dn",
    "companding_dn",
    "response_dn",
    "response_e",
)
OF_CAMERA = ("pitch_um", "cfa", "focal_length_mm", "f_number", "throughput_sr")
# {beginning of an array's name: its dimensions and unit}
ABOUT = {
    "electrons_": ("capture, y, x", "e, mean of the exposure, without dark charge"),
    "raw_": ("capture, y, x", "DN, without noise"),
    "noisy_": ("shot, capture, y, x", "DN"),
    "saturated_": ("capture, y, x", "true where the pixel is saturated"),
    "filter": ("y, x", "number of the pixel's channel"),
    "xyz": ("y, x, xyz", "cd m-2, Y is luminance"),
    "channel_radiance": ("channel, y, x", CHANNEL_RADIANCE),
    "instance": ("y, x", "number of the object, 0 for none"),
    "category": ("y, x", "number of the class"),
    "depth": ("y, x", "m, along the optical axis"),
    "distance": ("y, x", "m, along the line of sight"),
}


@dataclass(frozen=True)
class Sample:
    """One scene seen by one camera: arrays, and the labels that describe them."""

    camera: str
    arrays: dict[str, np.ndarray]
    labels: dict[str, Any]


def sample(camera: str, shots: Shots, truth: dict[str, Any], about: dict[str, Any]) -> Sample:
    """Return the arrays and labels to write for one scene and one camera.

    Parameters
    ----------
    camera : name of the camera.
    shots : exposures of the camera.
    truth : reference data, as `reference.reference` returns them.
    about : facts about the scene: name, road, weights of the light groups, noise of the renderer.
    """
    arrays = {
        **{f"electrons_{term}": values for term, values in shots.electrons.items()},
        **{f"raw_{member}": values for member, values in shots.raw.items()},
        **{f"saturated_{member}": values for member, values in shots.saturated.items()},
        **{f"noisy_{member}": values for member, values in shots.noisy.items()},
    }
    if "filter" in shots.captures:
        arrays["filter"] = shots.captures["filter"].values
    arrays |= {name: value for name, value in truth.items() if isinstance(value, np.ndarray)}
    captures = shots.captures
    figures = {name: captures[name].values.tolist() for name in OF_CAPTURE if name in captures}
    labels = {
        **about,
        "camera": camera,
        "captures": [str(name) for name in captures["capture"].values],
        "channels": [str(name) for name in captures["channel"].values]
        if "channel" in captures.coords
        else [],
        "of_captures": figures,
        "of_camera": {k: captures.attrs[k] for k in OF_CAMERA if k in captures.attrs},
        "arrays": {name: described(name, values) for name, values in arrays.items()},
        "objects": [_weighted(row, about["weights"]) for row in truth["objects"]],
        "lamps": truth["lamps"],
    }
    return Sample(camera, arrays, plain(labels))


def described(name: str, values: np.ndarray) -> dict[str, Any]:
    """Return the description of an array: dimensions, unit, type and shape.

    Parameters
    ----------
    name : name of the array.
    values : the array.
    """
    dims, unit = next(about for start, about in ABOUT.items() if name.startswith(start))
    return {"dims": dims, "unit": unit, "dtype": str(values.dtype), "shape": list(values.shape)}


def _weighted(row: dict[str, Any], weights: dict[str, float]) -> dict[str, Any]:
    """Return the row of an object with its illuminance under the lighting of the scene, lx.

    Parameters
    ----------
    row : row of the table of objects, with the illuminance of each light group at weight 1.
    weights : {light group: weight}.
    """
    if "illuminance_lx" not in row:
        return dict(row)
    lit = {group: lx * weights.get(group, 0.0) for group, lx in row["illuminance_lx"].items()}
    return {**row, "illuminance_lx": lit}


def plain(value: Any) -> Any:
    """Return a value in a form that JSON can hold. Numbers that are not finite become null."""
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
