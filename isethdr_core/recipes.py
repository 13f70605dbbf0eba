"""Scene radiance by recipe: use what is stored, render only what is missing.

A recipe is the scene, the renderer and their code; it holds no demand and no weights. A renderer names the
fields that buy accuracy but do not change the answer in `effort_fields` (for example `samples`):
a store that spent at least as much serves a run that asks for less.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from datetime import UTC, datetime

from . import store
from .demand import Demand
from .errors import CatalogError, ConfigError, did_you_mean
from .ledger import Ledger
from .pipeline import Chain, stage
from .provenance import fingerprint, versions
from .scene import SceneDescription

# what scenes and renderers use of the core: an edit elsewhere in it must not ask for another rendering
CORE = tuple(f"isethdr_core.{name}" for name in ("scene", "quantities", "categories", "physics.photometry", "physics.radiometry"))


def recipe_hash(parts: Chain) -> str:
    """Return the name of the radiance that the scene and the renderer describe together."""
    return store.content_hash({"scene": described(parts.scene), "renderer": described(parts.renderer, without=effort(parts)),
                               "code": fingerprint(parts.scene, parts.renderer, core=CORE), "versions": versions()})


def described(component, without=()) -> dict:
    """Return a component's class and fields as plain data."""
    fields = {k: v for k, v in asdict(component).items() if k not in without}
    return {"class": f"{type(component).__module__}.{type(component).__qualname__}", **fields}


def effort(parts: Chain) -> tuple[str, ...]:
    """Return the renderer's fields that buy accuracy only."""
    return tuple(getattr(type(parts.renderer), "effort_fields", ()))


def scene_radiance(parts: Chain, demand: Demand, rows: Ledger, config):
    """Return (scene radiance, store ids): read where it is stored, rendered and stored where it is not.

    A scene that knows its radiance (a chart, a file) needs no renderer and is not stored.
    """
    if parts.renderer is None:
        return _known(parts, stage(rows, "scene", config.scene.name, parts.scene, parts.scene)), []
    recipe, spent = recipe_hash(parts), {f: getattr(parts.renderer, f) for f in effort(parts)}
    folder = store.home() / "scenes"
    held = [s for s in stored(folder, recipe) if serves(s, demand, spent)]
    missing = missing_groups(held, demand)
    if missing is None or missing:
        description = stage(rows, "scene", config.scene.name, parts.scene, parts.scene)
        if not isinstance(description, SceneDescription):
            return _known(parts, description), []
        check_groups(parts, description.light_groups())
        for path in folder.glob(f"{recipe}-*.zarr"):
            store.read_attrs(path)      # a damaged one is named now, not when the new one cannot take its place
        ask = demand if missing is None else replace(demand, groups=missing)
        held.append(_render(parts, description, ask, rows, config, folder, recipe, spent))
    paths = [folder / f"{s['id']}.zarr" for s in held]
    return stage(rows, "radiance", "", None, lambda: store.join(paths)), [s["id"] for s in held]


def check_groups(parts: Chain, groups: tuple[str, ...]) -> None:
    """Raise ConfigError where a lighting names a group that the scene lacks: before the rendering, which takes longest."""
    for light in (parts.lighting, *(parts.versions.values() if len(groups) > 1 else ())):
        for table in ("weights", "targets"):
            for name, value in (getattr(light, table, None) or {}).items():
                if name not in groups and value:
                    raise ConfigError(f"the scene has no light group {name!r}{did_you_mean(name, groups)}; "
                                      f"type ~lighting.{table}.{name} to leave it out")


def missing_groups(held: list[dict], demand: Demand) -> tuple[str, ...] | None:
    """Return the groups that no store holds; None where nothing is held and everything is asked for."""
    if demand.groups is None and not held:
        return None
    wanted = demand.groups if demand.groups is not None else held[0]["all_groups"]
    covered = {g for s in held for g in (*s["groups"], *s["absent_groups"])}
    return tuple(g for g in wanted if g not in covered)


def _known(parts, scene):
    if isinstance(scene, SceneDescription):
        raise ConfigError(f"scene {scene.name!r} is geometry and needs a renderer; type for example renderer=mitsuba")
    return scene


def stored(folder, recipe: str) -> list[dict]:
    """Return the root attributes of every complete store of a recipe; damaged ones are skipped."""
    found = []
    for path in sorted(folder.glob(f"{recipe}-*.zarr")):
        try:
            found.append({**store.read_attrs(path), "id": path.stem})
        except CatalogError:
            continue
    return found


def serves(attributes: dict, demand: Demand, spent: dict) -> bool:
    """Return whether a store holds the bands and labels asked for and spent at least the effort asked for."""
    return (set(demand.labels) <= set(attributes["labels"])
            and (demand.wavelength_nm is None or set(demand.wavelength_nm) <= set(attributes["wavelength_nm"]))
            and all(attributes["effort"].get(key, 0) >= value for key, value in spent.items()))


def _render(parts, description, demand, rows, config, folder, recipe, spent) -> dict:
    radiance = stage(rows, "renderer", config.renderer.name, parts.renderer, lambda: parts.renderer(description, demand))
    groups = [str(g) for g in radiance.light_group.values]
    asked = demand.groups if demand.groups is not None else description.light_groups()
    name = f"{recipe}-{store.content_hash([sorted(groups), sorted(asked), sorted(demand.labels), demand.wavelength_nm, spent])[:8]}"
    attributes = {
        "kind": "scene", "recipe": recipe, "name": description.name, "groups": groups,
        "all_groups": list(description.light_groups()), "absent_groups": [g for g in asked if g not in groups],
        "wavelength_nm": [float(w) for w in radiance.wavelength.values],
        "labels": [v for v in radiance.data_vars if v != "radiance"], "effort": spent,
        "scene": described(parts.scene), "renderer": described(parts.renderer),
        "objects": radiance.attrs.get("objects", []), "lamps": radiance.attrs.get("lamps", []),
        "noise": radiance.attrs.get("noise", {}), "versions": versions(), "ledger": rows.as_records(),
        "created": datetime.now(UTC).isoformat(timespec="seconds")}
    stage(rows, "store", "scene", None, lambda: store.write_store(folder, name, {"": radiance}, attributes))
    return {**attributes, "id": name}
