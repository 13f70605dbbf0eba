"""The classes of road users that detectors are scored on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..export.labels.masks import ANIMALS

CLASSES = ("car", "truck", "person", "rider", "animal")
# {category of the labels: class}; other categories belong to no class
OF_CATEGORY = {
    "car": "car",
    "truck": "truck",
    "bus": "truck",
    "person": "person",
    **dict.fromkeys(ANIMALS, "animal"),
}
RIDER = "rider of "  # beginning of the name of a person on a two-wheeler


def class_of(row: Mapping[str, Any]) -> str:
    """Return the class of an object; "" if it belongs to no class.

    A rider is the person on a two-wheeler, without the two-wheeler, as in BDD100K and Cityscapes.
    A bus counts as a truck.

    Parameters
    ----------
    row : row of the table of objects: category and name.
    """
    if row["category"] == "person" and str(row.get("name", "")).startswith(RIDER):
        return "rider"
    return OF_CATEGORY.get(row["category"], "")
