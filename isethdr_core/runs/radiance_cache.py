"""Scene radiance by recipe: use what is stored, render only what is missing.

A recipe is the scene, the renderer and their code; it holds no demand and no weights. A renderer
names the fields that buy accuracy but do not change the answer in `effort_fields` (for example
`samples`): a store that spent at least as much serves a run that asks for less. A renderer with a
method `enough(paths, noise)` goes on from what is stored instead: its stores are pooled
(`sample_accumulation`), and it is called with what is known of each light group, `{group: Known}`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from ..data.scene_description import SceneDescription
from ..errors import CatalogError, ConfigError
from ..identity.earlier_names import radiance_names
from ..pipeline.bands import of_demand
from ..pipeline.chain import Chain, stage
from ..pipeline.demand import Demand
from ..pipeline.early_checks import check_lightings
from ..plugins.protocols import AccumulatesSamples, MeetsNoiseLimit, NamesItsEffort
from ..storage import store
from ..storage.encoding import bits_for, rounding
from ..storage.join import join_scenes
from ..uncertainty.budget import stored_error
from ..uncertainty.error_terms import RELATIVE, ErrorTerm, Quantity, Source
from ..uncertainty.ledger import Ledger, error, left_out, record
from .claims import claimed
from .processor import kernels
from .provenance import described, fingerprint, libraries, versions
from .sample_accumulation import ALL_BANDS, Known, holds, known

ROUNDING = "store rounding"  # key of the rounding of stored radiance
NOISE = "accumulated noise"  # key of the noise of several renderings together; part: light group


def recipe_hash(parts: Chain) -> str:
    """Return the name of the radiance that the scene and the renderer describe together.

    An earlier name of the same radiance is returned where only that one is stored.
    """
    name = store.content_hash(
        {
            "scene": described(parts.scene),
            "renderer": described(parts.renderer, without=effort(parts)),
            "code": fingerprint(parts.scene, parts.renderer),
            "versions": libraries(parts.scene, parts.renderer),
        }
    )
    folder = store.home() / "scenes"
    if _is_stored(folder, name):
        return name
    earlier = radiance_names(parts.scene, parts.renderer, effort(parts))
    return next((n for n in earlier if _is_stored(folder, n)), name)


def _is_stored(folder: Path, recipe: str) -> bool:
    return any(folder.glob(f"{recipe}-*.zarr"))


def effort(parts: Chain) -> tuple[str, ...]:
    """Return the renderer's fields that buy accuracy only."""
    renderer = parts.renderer
    return tuple(renderer.effort_fields) if isinstance(renderer, NamesItsEffort) else ()


def scene_radiance(parts: Chain, demand: Demand, rows: Ledger, config):
    """Return (scene radiance, store ids): read where it is stored, rendered and stored where it is
    not.

    A scene that knows its radiance (a chart, a file) needs no renderer and is not stored.
    """
    if parts.renderer is None:
        return (
            of_demand(
                _known(
                    parts,
                    stage(rows, "scene", config.scene.name, parts.scene, lambda: made(parts.scene)),
                ),
                demand,
            ),
            [],
        )
    recipe, spent, folder = recipe_hash(parts), effort_spent(parts), store.home() / "scenes"
    held, missing = held_and_missing(parts, demand)
    before = [s["id"] for s in held]
    if missing:
        description = stage(
            rows, "scene", config.scene.name, parts.scene, lambda: made(parts.scene)
        )
        if not isinstance(description, SceneDescription):
            return _known(parts, description), []
        # before the rendering, which takes longest
        check_lightings(description.light_groups(), parts.lighting, tuple(parts.versions.values()))
        with _rendering_alone(folder, recipe):
            held, missing = held_and_missing(parts, demand)  # another process may have stored it
            before = [s["id"] for s in held]
            for path in folder.glob(f"{recipe}-*.zarr"):
                store.read_attrs(
                    path
                )  # a damaged one is named now, not when the new one cannot take its place
            if missing:
                so_far = known_of(parts, held, missing, description.light_groups())
                held.append(
                    _render(
                        parts, description, missing, so_far, rows, config, folder, recipe, spent
                    )
                )
    return stage(rows, "radiance", "", None, lambda: opened(folder, held, demand, rows, before)), [
        s["id"] for s in held
    ]


@contextmanager
def _rendering_alone(folder: Path, recipe: str) -> Iterator[None]:
    """Let one process at a time render a recipe; the others wait and say so."""
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            stack.enter_context(
                claimed(folder, recipe, partial(print, file=sys.stderr, flush=True))
            )
        except OSError as error:
            raise CatalogError(
                f"cannot write scenes into {folder}: {error.strerror}; choose another folder with"
                " ISETHDR_HOME=/path"
            ) from error
        yield


def effort_spent(parts: Chain) -> dict:
    """Return the values of the renderer's fields that buy accuracy only."""
    return {f: getattr(parts.renderer, f) for f in effort(parts)}


def held_and_missing(parts: Chain, demand: Demand) -> tuple[list[dict], Demand | None]:
    """Return the attributes of the stores that serve `demand`, and the demand for what none of them
    holds, None where that is nothing.
    """
    if parts.renderer is None:
        return [], None
    found = [
        s
        for s in stored(store.home() / "scenes", recipe_hash(parts))
        if serves(s, demand, {} if goes_on(parts) else effort_spent(parts))
    ]
    wide = demand.margin or any(
        s.get("margin", True) for s in found
    )  # all of one grid: what has a margin serves whoever needs none
    held = [s for s in found if s.get("margin", True) == wide]
    wanted = replace(demand, margin=wide)
    return held, what_is_missing(held, wanted, goes_on(parts), limit_share(parts, demand))


def goes_on(parts: Chain):
    """Return the renderer's method `enough`; None where it cannot go on from what is stored."""
    return parts.renderer.enough if isinstance(parts.renderer, AccumulatesSamples) else None


def limit_share(parts: Chain, demand: Demand) -> float | None:
    """Return the share of the cameras' noise that the renderer goes by; None where it goes by
    something else.
    """
    if demand.noise_limit is None or not isinstance(parts.renderer, MeetsNoiseLimit):
        return None
    return parts.renderer.limit_share()


def known_of(parts: Chain, held: list[dict], missing: Demand, groups) -> dict[str, Known] | None:
    """Return what is stored of each light group at the bands that are missing; None where the
    renderer cannot go on from it.
    """
    if goes_on(parts) is None:
        return None
    bands = ALL_BANDS if missing.wavelength_nm is None else missing.wavelength_nm
    found = {group: known(held, group, bands) for group in missing.groups or groups}
    return {
        group: k if k.paths > 1 else Known(next=k.next) for group, k in found.items()
    }  # one path alone is not pooled


def made(scene):
    """Return what the scene plugin makes; a description is what is rendered by definition, so
    nothing in it can be wrong.
    """
    result = scene()
    if isinstance(result, SceneDescription):
        error(0.0, "m", "bound", "geometry, materials and lamps are exact by definition")
    return result


def opened(folder, held: list[dict], demand: Demand, rows: Ledger, before=()):
    """Return the stores `held` as one lazy Dataset; restate the errors of those that were rendered
    in an earlier run.

    `before` : names of those that this run did not render, whose paths it did not have to follow.
    """
    scenes = [store.open_store(folder / f"{s['id']}.zarr") for s in held]
    kept_bits = [s["radiance"].attrs.get("keepbits") for s in scenes]
    largest = max(map(rounding, kept_bits))
    record(rounding_term(largest))
    said = [term for row in rows for term in row.errors]
    terms = [
        term
        for s in held
        for row in Ledger.from_records(s["ledger"])
        if row.kind == "renderer"
        for term in row.errors
    ]
    whole = join_scenes(scenes, demand.groups)
    pooled = "paths" in whole.attrs  # then their noise together is stated
    record(*(t for t in terms if t not in said and not (pooled and t.how == "statistical")))
    _record_pooled(whole, held, before, said)
    joined = of_demand(whole, demand)
    return joined.assign_attrs(
        rendered_s=sum(
            row["seconds"]
            for s in held
            for row in s["ledger"]
            if row["stage"].startswith("renderer")
        )
    )


def rounding_term(largest: float) -> ErrorTerm:
    """Return the term of stored radiance whose mantissa is rounded by at most `largest`,
    relative.
    """
    label = "radiance as stored, rounded in its mantissa"
    source = Source("radiance", key=ROUNDING)
    return ErrorTerm(source, Quantity.RADIANCE, None, largest, RELATIVE, "bound", label)


def _record_pooled(joined, held, before, said) -> None:
    """State the noise of each light group of pooled stores, and how many of their paths were there
    before this run.
    """
    # a renderer states the noise of each light group as that of a part of the radiance
    stated = {t.part for t in said if t.source.kind == "renderer" and t.how == "statistical"}
    for group, paths in joined.attrs.get("paths", {}).items():
        noise = joined.attrs["noise"].get(group)
        if noise is not None and group not in stated:
            label = f"{paths} samples per tile: median over tiles, light group {group}"
            source = Source("renderer", key=NOISE)
            record(
                ErrorTerm(source, Quantity.RADIANCE, group, noise, RELATIVE, "statistical", label)
            )
        if reused := known(
            [s for s in held if s["id"] in before], group, joined.wavelength.values
        ).paths:
            left_out(
                f"{reused} of {paths} samples per tile of light group {group}",
                "stored by an earlier run",
                0.0,
                "relative",
            )


def what_is_missing(
    held: list[dict], demand: Demand, enough=None, share: float | None = None
) -> Demand | None:
    """Return the demand for the groups and bands that no store holds, None where all are held.

    Groups that lack different bands are rendered at all bands that any of them lacks.
    `enough(paths, noise)` : whether stores that hold a group know it well enough; None: whatever is
        held is. `share` : of the cameras' noise, where the renderer goes by that.
    """
    if demand.groups is None and not held:
        return demand
    wanted = demand.groups if demand.groups is not None else held[0]["all_groups"]
    bands = ALL_BANDS if demand.wavelength_nm is None else demand.wavelength_nm
    lacking = {
        group: [b for b in bands if not _held(held, group, b, enough, share)] for group in wanted
    }
    groups = tuple(g for g in wanted if lacking[g])
    if not groups:
        return None
    return replace(
        demand,
        groups=groups,
        wavelength_nm=demand.wavelength_nm
        and tuple(b for b in bands if any(b in lacking[g] for g in groups)),
    )


def _held(held, group, band, enough, share) -> bool:
    mine = [s for s in held if holds(s, group, band)]
    if enough is None or not mine or any(group in s["absent_groups"] for s in mine):
        return bool(mine)
    if share is not None:
        return any((s.get("limit_share") or float("inf")) <= share for s in mine)
    of = known(mine, group, (band,))
    return enough(of.paths, of.noise)


def _known(parts, scene):
    if isinstance(scene, SceneDescription):
        raise ConfigError(
            f"scene {scene.name!r} is geometry and needs a renderer; type for example"
            " renderer=mitsuba"
        )
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
    """Return whether a store holds the labels asked for and spent at least the effort asked for."""
    return set(demand.labels) <= set(attributes["labels"]) and all(
        attributes["effort"].get(key, 0) >= value for key, value in spent.items()
    )


def _render(parts, description, demand, so_far, rows, config, folder, recipe, spent) -> dict:
    asked_of = (description, demand) if so_far is None else (description, demand, so_far)
    radiance = stage(
        rows, "renderer", config.renderer.name, parts.renderer, lambda: parts.renderer(*asked_of)
    )
    groups = [str(g) for g in radiance.light_group.values]
    asked = demand.groups if demand.groups is not None else description.light_groups()
    content = [
        sorted(groups),
        sorted(asked),
        sorted(demand.labels),
        demand.wavelength_nm,
        demand.margin,
        spent,
        so_far,
    ]
    name = f"{recipe}-{store.content_hash(content)[:8]}"
    attributes = {
        "kind": "scene",
        "recipe": recipe,
        "name": description.name,
        "groups": groups,
        "all_groups": list(description.light_groups()),
        "absent_groups": [g for g in asked if g not in groups],
        "bands_asked": demand.wavelength_nm,
        "margin": demand.margin,
        "wavelength_nm": [float(w) for w in radiance.wavelength.values],
        "labels": [v for v in radiance.data_vars if v != "radiance"],
        "effort": spent,
        "scene": described(parts.scene),
        "renderer": described(parts.renderer),
        "objects": radiance.attrs.get("objects", []),
        "lamps": radiance.attrs.get("lamps", []),
        "noise": radiance.attrs.get("noise", {}),
        "path_span": radiance.attrs.get("path_span", {}),
        "limit_share": radiance.attrs.get("limit_share"),
        "versions": versions() | libraries(parts.scene, parts.renderer),
        "code": fingerprint(parts.scene, parts.renderer),
        "kernels": kernels(parts.scene, parts.renderer),
        "ledger": rows.as_records(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    bits = bits_for(stored_error(demand))
    stage(
        rows,
        "store",
        "scene",
        None,
        lambda: store.write_store(folder, name, {"": radiance}, attributes, bits),
    )
    return {**attributes, "id": name}
