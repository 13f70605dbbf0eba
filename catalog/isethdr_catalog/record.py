"""Record: the searchable properties of one store, taken from its root attributes only.

A scene store gives one record. A run gives one per camera, so that `sensor=rgbw` and a score belong
together. The properties are flat: `scene.seed`, `weights.sky`, `ledger.seconds`,
`person.distance_m` (the nearest object of a category), `ssim` (a score of the whole picture),
`scores` (their names), `warnings` (their keys), `tags` and `sweeps` (labels beside the store).
"""

from __future__ import annotations

import json
from pathlib import Path

from isethdr_core.runs.labels import read_labels
from isethdr_core.storage.object_home.calls import home_of_stub
from isethdr_core.store import read_attrs

SCHEMA = 4  # increased when records of an earlier version must be read again
# attributes whose entries become properties with dotted names
NESTED = ("config", "scene", "renderer", "weights", "noise", "effort", "versions", "kernels")


def records(path: Path, folder: Path) -> list[dict]:
    """Return the records of the store `path`; they state its path relative to `folder`.

    Raises
    ------
    CatalogError : the store is damaged or incomplete.
    """
    path, attrs = Path(path), read_attrs(path)
    kind = attrs.get("kind", "scene")
    objects = attrs.get("objects") or []
    scores = attrs.get("scores") or []
    common = {
        "id": path.stem,
        "kind": kind,
        "path": str(path.relative_to(folder)),
        "created": attrs.get("created"),
        "name": str(attrs.get("name") or attrs.get("scene_id") or ""),
        "derived_from": attrs.get("scene_id") or None,
        "objects": objects,
        "ledger": attrs.get("ledger") or [],
        "assets": assets(path),
    }
    properties = flat(attrs) | nearest(objects)
    if kind != "run":
        return [common | {"camera": None, "scores": [], "properties": properties}]
    labels = read_labels(path)
    common["name"] = labels.name or common["name"]
    properties |= {"tags": list(labels.tags), "sweeps": list(labels.sweeps)}
    shots = []
    for camera in attrs.get("cameras") or [""]:
        whole_picture_scores = whole_picture(scores, camera)
        more = {"camera": camera, "sensor": sensor(attrs, camera), **whole_picture_scores}
        more |= {"scores": sorted(whole_picture_scores), "warnings": warned(attrs, camera)}
        scores_of_camera = [score for score in scores if score.get("camera") == camera]
        shots.append(
            common | {"camera": camera, "scores": scores_of_camera, "properties": properties | more}
        )
    return shots


def sensor(attrs: dict, camera: str) -> str:
    """Return the registered name of a camera's sensor, or the name that the run recorded."""
    config = attrs.get("config") or {}
    chosen = (config.get("cameras") or {}).get(camera) or config.get("sensor") or {}
    named = chosen.get("name") if isinstance(chosen, dict) else chosen
    return str(named or (attrs.get("sensors") or {}).get(camera) or camera)


def flat(attrs: dict) -> dict:
    """Return the searchable root attributes with dotted names: numbers, text, and lists of
    either.
    """
    attributes = {}
    for key, value in attrs.items():
        if key in NESTED and isinstance(value, dict):
            _flatten(value, key, attributes)
        elif _plain(value):
            attributes[key] = value
    attributes["ledger.seconds"] = sum(row.get("seconds", 0) for row in attrs.get("ledger") or [])
    return attributes


def nearest(objects: list[dict]) -> dict:
    """Return for each category the number of objects, and the distance, m, and visible fraction of
    the nearest one.
    """
    by_category = {}
    # the nearest comes last
    for entry in sorted(objects, key=lambda o: -_number(o.get("distance_m"), float("inf"))):
        category = entry.get("category")
        by_category[f"{category}.count"] = by_category.get(f"{category}.count", 0) + 1
        by_category[f"{category}.distance_m"] = entry.get("distance_m")
        by_category[f"{category}.visible_fraction"] = entry.get("visible_fraction")
    return by_category


def whole_picture(scores: list[dict], camera: str) -> dict:
    """Return {metric: value} of the scores of the whole picture of one camera."""
    return {
        s["metric"]: s["value"] for s in scores if s.get("camera") == camera and not s.get("object")
    }


def warned(attrs: dict, camera: str) -> list[str]:
    """Return the keys of the warnings about one camera of a run."""
    return [w["key"] for w in attrs.get("warnings") or [] if w.get("camera") == camera]


def assets(path: Path) -> list[str]:
    """Return the names of the groups and arrays that a store holds."""
    if home_of_stub(path):
        root = json.loads((path / "zarr.json").read_bytes())
        return sorted(root["consolidated_metadata"]["metadata"])
    return sorted(
        str(p.parent.relative_to(path)) for p in path.glob("**/zarr.json") if p.parent != path
    )


def _flatten(value: dict, prefix: str, flat_attributes: dict) -> None:
    for key, inner in value.items():
        if isinstance(inner, dict):
            _flatten(inner, f"{prefix}.{key}", flat_attributes)
        elif _plain(inner):
            flat_attributes[f"{prefix}.{key}"] = inner


def _plain(value: int | str | list[str]) -> bool:
    scalar = (str, int, float, bool)
    return (
        isinstance(value, scalar)
        or isinstance(value, list)
        and len(value) <= 64
        and all(isinstance(v, scalar) for v in value)
    )


def _number(value: float, otherwise: float) -> float:
    return float(value) if isinstance(value, (int, float)) else otherwise
