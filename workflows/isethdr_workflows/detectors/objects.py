"""The objects that a detector should find in a picture of a run, with the properties by which they
are grouped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.display.display_view import lamp_mask, luminance
from isethdr_core.errors import CatalogError
from isethdr_core.physics.optics.projection import direction

from ..dataset.summary import illuminance
from ..export.labels.masks import visible_objects
from .classes import class_of

if TYPE_CHECKING:
    import xarray as xr

LEAST_HEIGHT_PX = 8.0  # smaller objects count neither as missed nor as found
LEAST_VISIBLE = 0.3  # least share of an object's pixels that nothing hides
MOST_TRUNCATION = 0.7  # largest share of the whole box outside the frame
LAMP_NEAR_DEG = 3.0  # largest angle between an object and a lamp near it


@dataclass(frozen=True)
class TruthObject:
    """One visible object of a class in the picture of one camera."""

    instance: int
    class_name: str
    category: str
    name: str
    box: tuple[float, float, float, float]  # left, top, right, bottom of the visible part, px
    distance_m: float
    # vertical illuminance towards the camera by all light groups; NaN if it is not known
    illuminance_lx: float
    lamp_near: bool  # whether a lamp of another object is within 3 degrees
    visible_fraction: float
    truncation: float

    @property
    def height_px(self) -> float:
        """The height of the visible part."""
        return self.box[3] - self.box[1]

    @property
    def counted(self) -> bool:
        """Whether it is large and visible enough to count."""
        return (
            self.height_px >= LEAST_HEIGHT_PX
            and self.visible_fraction >= LEAST_VISIBLE
            and self.truncation <= MOST_TRUNCATION
        )


def truth_objects(truth: xr.Dataset, weights: Mapping[str, float]) -> list[TruthObject]:
    """Return the objects of all classes that have at least one pixel.

    Parameters
    ----------
    truth : reference picture with the label `instance` and the attribute `objects`.
    weights : {light group: weight} of the run's lighting.

    Raises
    ------
    CatalogError : the run has no map of objects.
    """
    if "instance" not in truth or "objects" not in truth.attrs:
        raise CatalogError(
            "the run has no map of objects; a rendered scene stores it where a metric reads it;"
            " type for example metric@metric.contrast=object_contrast"
        )
    instance = truth["instance"].values
    lamps = np.argwhere(lamp_mask(luminance(truth)))
    of_lamps = instance[tuple(lamps.T)]
    found = []
    for seen in visible_objects(truth):
        row = seen.row
        name = class_of(row)
        if not name:
            continue
        left, top, width, height = seen.box
        box = (left, top, left + width, top + height)
        others = lamps[of_lamps != row["instance"]]
        found.append(
            TruthObject(
                instance=int(row["instance"]),
                class_name=name,
                category=row["category"],
                name=str(row.get("name", "")),
                box=box,
                distance_m=float(row["distance_m"]),
                illuminance_lx=illuminance(row, weights),
                lamp_near=nearest_lamp_deg(truth, others, box) <= LAMP_NEAR_DEG,
                visible_fraction=float(row.get("visible_fraction", 1.0)),
                truncation=float(row.get("truncation", 0.0)),
            )
        )
    return found


def nearest_lamp_deg(
    truth: xr.Dataset, lamps: np.ndarray, box: tuple[float, float, float, float]
) -> float:
    """Return the angle between a box and the nearest lamp, degrees; infinity without a lamp.

    It is the angle between the viewing directions of two pixels through a lens without distortion.

    Parameters
    ----------
    truth : reference picture, for its pixels.
    lamps : (n, 2) row and column of the pixels of lamps.
    box : left, top, right, bottom, px.
    """
    if not len(lamps):
        return float("inf")
    left, top, right, bottom = box
    near = np.clip(lamps, (top, left), (bottom - 1, right - 1))
    cosine = (_directions(truth, lamps) * _directions(truth, near)).sum(1)
    return float(np.degrees(np.arccos(np.clip(cosine.max(), -1, 1))))


def _directions(truth: xr.Dataset, pixels: np.ndarray) -> np.ndarray:
    """Return the unit vectors (n, 3) of pixels (n, 2) given by row and column."""
    focal_m = 1e-3 * float(truth.attrs["focal_length_mm"])
    rows = np.asarray(pixels[:, 0], int)
    columns = np.asarray(pixels[:, 1], int)
    x = truth["x"].values[columns] / focal_m
    y = truth["y"].values[rows] / focal_m
    return direction(x, y, projection_of(truth)).T
