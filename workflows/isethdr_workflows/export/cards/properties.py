"""Properties of each picture on cards: run, camera, sensor, lighting, lens, scene, scores."""

from __future__ import annotations

from typing import Any

from isethdr_catalog.record import sensor, whole_picture

from ..job import Item


def properties(item: Item) -> dict[str, Any]:
    """Return the properties of a picture by the names that queries use. They include the scores of
    the whole picture that are finite numbers.
    """
    recorded = item.attributes
    found = {
        "run": item.key,
        "camera": item.camera,
        "sensor": sensor(recorded, item.camera),
        "lighting": str(recorded.get("lighting", "")),
        "lens": str(recorded.get("lens", "")),
        "scene": str(recorded.get("config", {}).get("scene", {}).get("name", "")),
        "tags": list(item.run.labels.tags),
    }
    scores = whole_picture(recorded.get("scores") or [], item.camera)
    finite = {name: v for name, v in scores.items() if isinstance(v, (int, float)) and v - v == 0}
    return found | {name: value for name, value in finite.items() if name not in found}
