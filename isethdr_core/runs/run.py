"""One run: named by the hash of its inputs, computed at most once, and stored completely or not at
all.
"""

from __future__ import annotations

import errno
import os
import traceback
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from omegaconf import OmegaConf
from threadpoolctl import threadpool_limits

from ..data.quantities import tristimulus
from ..errors import CatalogError
from ..identity.earlier_names import run_names
from ..motion.run_time import sub_frame_work
from ..motion.settings import without_motion
from ..motion.sub_frames import Still, in_motion
from ..pipeline.chain import (
    SHOWN,
    Camera,
    Chain,
    chain,
    checked_config,
    frame_of,
    imaging,
    plan,
    stage,
    through_cameras,
)
from ..pipeline.imaging_plan import labelled
from ..pipeline.memory_estimate import STATED, stated_parts
from ..pipeline.runtime_estimate import (
    IMAGING,
    PIXELS,
    expected_s,
    imaging_s,
    newest,
    pixel_bytes,
)
from ..pipeline.shot import LightNames, Shot
from ..plugins.component import Stage
from ..plugins.protocols import MovesInTime, NamesItsShot
from ..plugins.registry import plugin_manager
from ..results.html import html_of
from ..results.plot import plotted
from ..sequence.exposure import without_exposures
from ..sequence.frame_exposures import at_carried_exposures
from ..storage import store
from ..storage.object_home.calls import follow_home, prepare_writing, publish_store
from ..uncertainty.ledger import Ledger
from .labels import SETTINGS, Labels, add_labels, labels_of, read_labels
from .processor import kernels
from .provenance import described, fingerprint, input_digests, libraries, versions
from .radiance_cache import held_and_missing, recipe_hash, scene_radiance
from .result_names import of_light, of_mixed, of_motion, of_radiance
from .reuse import Kept, Reuse, cache_bytes
from .run_warnings import warnings_of
from .seeds import generator

if TYPE_CHECKING:
    import xarray as xr
    from omegaconf import DictConfig

# keys of a config that do not name a run: Hydra's own, names of presets, settings without effect
BESIDE = ("hydra", "experiment", "choices", "cache_gb", *SETTINGS)


@dataclass
class Result:
    """A finished run, read back from its store."""

    path: Path
    attributes: dict[str, Any]
    computed: bool  # False: the same run was already stored

    def __repr__(self) -> str:  # without the whole record, which takes pages
        return f"Result({str(self.path)!r}, computed={self.computed})"

    @property
    def key(self) -> str:
        """The run's name: the hash of its config, code, versions and inputs."""
        return str(self.attributes["key"])

    @cached_property
    def ledger(self) -> Ledger:
        """The rows: stage, seconds, peak memory, error, what was left out."""
        return Ledger.from_records(self.attributes["ledger"])

    @property
    def scores(self) -> list[dict[str, Any]]:
        """One dictionary per camera, metric and object."""
        return list(self.attributes["scores"])

    @property
    def labels(self) -> Labels:
        """Name, tags and sweeps of the run, as they are now."""
        return read_labels(self.path)

    @property
    def warnings(self) -> list[dict[str, Any]]:
        """One dictionary per warning: key, camera, value, limit and unit (`run_warnings`)."""
        return list(self.attributes.get("warnings", []))

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras."""
        return list(self.attributes["cameras"])

    def plot(self, of: str = "picture") -> Any:
        """Return a Matplotlib figure with the picture of each camera, the right way up, in mm.

        Parameters
        ----------
        of : `picture`, the display view, or `luminance`, cd/m2 on a logarithmic scale.
        """
        return plotted(self, of)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: pictures, scores with intervals, the path."""
        return html_of(self)

    def open(self, group: str) -> xr.Dataset:
        """Return one group of the store as a Dataset, for example `picture/bayer`, `captures/bayer`
        or `truth/bayer`.

        A run with a report also has the group `versions/main`. If the scene has several light
        groups, each further lighting of the report has a group, for example `versions/day`.
        """
        return store.open_store(self.path, group)


def run(config: DictConfig) -> Result:
    """Run the chain that a composed config describes, or return the stored run of the same key.

    Raises
    ------
    IsetHdrError : bad input, named before expensive work starts; nothing already stored is lost.
    """
    config = checked_config(config)
    labels = labels_of(config)
    reuse = Reuse.below(cache_bytes(config))
    run_chain = chain(config)
    settings = whole(config)  # called once: OmegaConf takes longer for it than some stages take
    key = run_key(settings, run_chain)
    folder = store.home() / "runs"
    follow_home(store.home())
    path = find_run(settings, run_chain)
    if path is not None:
        publish_store(path)
        return announced(Result(path, store.read_attrs(path), computed=False), run_chain, labels)
    check_writable(folder)
    failed = store.home() / "failed" / f"{key}.txt"
    try:
        # one thread for BLAS: more would compete with the threads of the stages, and wait actively
        # for longer than they work
        with threadpool_limits(1, "blas"):
            path = _compute(config, plain(settings), run_chain, key, reuse)
    except Exception as err:
        with suppress(OSError):  # a full disk must not hide the error that it caused
            failed.parent.mkdir(parents=True, exist_ok=True)
            # a path may hold bytes that are no text
            text = traceback.format_exc()
            failed.write_text(text, encoding="utf-8", errors="backslashreplace")
            err.add_note(f"traceback in {failed}")
        plugin_manager().hook.isethdr_on_stage_error(stage=Stage("run", key, run_chain, error=err))
        raise
    with suppress(OSError):  # another user of the same home may have written it
        failed.unlink(missing_ok=True)
    return announced(Result(path, store.read_attrs(path), computed=True), run_chain, labels)


def announced(result: Result, chain: Chain, labels: Labels) -> Result:
    """Label a finished run and tell the plugins of it. A run that was stored before is announced
    too: a missing report is then made.

    Parameters
    ----------
    result : finished run.
    chain : components of the run.
    labels : tags and sweep of the run; none leave the stored labels as they are.
    """
    if labels != Labels():
        add_labels(result.path, labels)
    plugin_manager().hook.isethdr_after_stage(stage=Stage("run", result.key, chain, result=result))
    return result


def check_writable(folder: Path) -> None:
    """Raise CatalogError if no store could be written later. The check takes a moment, and the work
    before the writing may take hours. In an object home, stores are published whose publication was
    interrupted.
    """
    prepare_writing(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, "no permission to write there")
    except OSError as err:
        raise CatalogError(
            f"cannot write stores into {folder}: {err.strerror}; "
            "choose another folder with ISETHDR_HOME=/path"
        ) from err


def run_key(config: Mapping[str, Any] | DictConfig, chain: Chain) -> str:
    """Return the hash of all that can change the result.

    The hash covers the resolved config (or its `plain` data), the code of the components and of the
    core, the versions of the libraries that they import, and the input files.
    """
    components = chain.components()
    return store.content_hash(
        {
            "config": plain(config),
            "code": fingerprint(*components, frame=True),
            "versions": libraries(*components, frame=True),
            "inputs": input_digests(*components),
        }
    )


def find_run(config: Mapping[str, Any] | DictConfig, chain: Chain) -> Path | None:
    """Return the complete store of a run, under its name or an earlier one, or None.

    Raises
    ------
    CatalogError : the store is damaged.
    """
    folder = store.home() / "runs"
    if path := store.find_complete(folder, run_key(config, chain)):
        return path
    components = chain.components()
    if not folder.is_dir():
        return None
    earlier = run_names(whole(config), components, input_digests(*components))
    stored = (store.find_complete(folder, name) for name in earlier)
    return next(filter(None, stored), None)


def plain(config: Mapping[str, Any] | DictConfig) -> dict[str, Any]:
    """Return a composed config as plain data, without Hydra's own node.

    The table of cameras is left out if a single sensor is named, because the sensor replaces it.
    """
    settings = whole(config)
    if settings.get("sensor"):
        settings.pop("cameras", None)
    elif isinstance(cameras := settings.get("cameras"), dict):
        settings["cameras"] = {name: node for name, node in cameras.items() if node}
    return settings


def whole(config: Mapping[str, Any] | DictConfig) -> dict[str, Any]:
    """Return a composed config as plain data, without the keys that change no result."""
    settings = (
        OmegaConf.to_container(config, resolve=True) if OmegaConf.is_config(config) else config
    )
    assert isinstance(settings, Mapping)
    named = without_motion({str(k): v for k, v in settings.items() if k not in BESIDE})
    return without_exposures(named)


def _compute(
    config: DictConfig, settings: dict[str, Any], chain: Chain, key: str, reuse: Reuse
) -> Path:
    """Return the store of a run that was just computed; `settings` are those that name it."""
    rows = Ledger()
    demand = plan(chain, rows)
    frame = frame_of(chain, demand)
    missing = held_and_missing(chain, demand)[1]
    moving_work = sub_frame_work(chain, demand, newest("runs")) if chain.motion else None
    expected = expected_s(chain, settings, missing, frame, moving_work)
    stated = stated_parts(chain, frame, missing is not None)
    own_s = imaging_s(chain, frame)  # estimated before this run stores results of its lens
    kernels(*chain.components())  # the record needs them; a mistake in one must not cost the work
    scene, ids = scene_radiance(chain, demand, rows, config)
    radiance = of_radiance(chain.scene, ids, demand) if reuse.is_on else None
    of_main = of_mixed(radiance, chain.lighting)
    mixed = stage(
        rows,
        "lighting",
        config.lighting.name,
        chain.lighting,
        lambda: chain.lighting(scene),
        Kept(reuse, of_main),
    )
    versions_mixed = {
        name: stage(
            rows,
            "lighting",
            name,
            light,
            lambda part=light: part(scene),
            Kept(reuse, of_mixed(radiance, light)),
        )
        for name, light in chain.versions.items()
        if scene.sizes["light_group"] > 1
    }
    moving = in_motion(chain, demand, rows, config, Still(scene, mixed))
    start = mixed
    of_shot = of_main
    if moving is not None:
        scene = moving.scene
        mixed = moving.mixed
        of_shot = of_motion(of_main, moving.record)
    names = LightNames(radiance, of_main, of_light(of_shot, chain, demand, mixed))
    imaged = imaging(chain, labelled(chain.lens, mixed, scene), demand)
    light = stage(
        rows, "lens", config.lens.name, chain.lens, imaged.light, Kept(reuse, names.light)
    )
    random = generator(config.seed, config.device, shot_name(config.scene.name, chain, ids))
    shot = Shot(light, mixed, scene, random, imaged, reuse, names, start)
    chain, exposures = at_carried_exposures(chain, rows, light)
    cameras = through_cameras(chain, rows, shot)
    for row in rows:
        row.light_parts.clear()  # as large as the light, and not needed any more
    outcome = _Outcome(chain, scene, ids, start, list(versions_mixed), cameras, rows)
    estimates = {
        "expected_s": expected,
        IMAGING: own_s,
        PIXELS: pixel_bytes(chain),
        STATED: stated and sum(stated.values()),
    }
    record = _record(config, settings, key, outcome) | estimates
    if moving is not None:
        record["motion"] = moving.record
    if exposures:
        record["exposures"] = exposures
    return store.write_store(
        store.home() / "runs",
        key,
        _groups(cameras, {SHOWN: start, **versions_mixed} if chain.reported else {}),
        record,
    )


def shot_name(name: str, chain: Chain, ids: list[str]) -> str:
    """Return the name of a shot, the key of its random numbers: frames of a sequence have different
    noise, also of a scene that stands still.

    Parameters
    ----------
    name : name of the scene component.
    chain : components of the run.
    ids : stores of the scene radiance; empty for radiance that the scene itself makes.
    """
    # The recipe is used, not the store: the noise must not depend on the order in which groups were
    # rendered, nor on another frame with the same light.
    if ids:
        return recipe_hash(chain)
    scene = chain.scene
    if isinstance(scene, NamesItsShot):
        return scene.shot_name()
    if isinstance(scene, MovesInTime) and scene.time_s:
        return f"{name} at {scene.time_s!r} s"
    return name


@dataclass(frozen=True)
class _Outcome:
    """Results of one run, recorded in its store."""

    chain: Chain
    scene: xr.Dataset  # scene radiance
    scene_ids: list[str]  # stores that it was read from
    mixed: xr.DataArray  # mixed radiance under the lighting of the run
    versions_shown: list[str]  # further lightings that a report shows
    cameras: dict[str, Camera]
    rows: Ledger


def _groups(cameras: dict[str, Camera], radiance_of: Mapping[str, xr.DataArray]) -> dict[str, Any]:
    groups = {f"versions/{name}": tristimulus(m) for name, m in radiance_of.items()}
    for name, camera in cameras.items():
        # normals lie along a dimension `xyz`, and a picture has a variable of that name
        labels = (
            camera.labels.rename_dims(xyz="direction")
            if "xyz" in camera.labels.dims
            else camera.labels
        )
        truth = camera.truth.assign({v: labels[v] for v in labels.data_vars}).assign_attrs(
            labels.attrs
        )
        groups |= {
            f"captures/{name}": camera.captures,
            f"picture/{name}": camera.picture,
            f"truth/{name}": truth,
        }
    return groups


def _record(
    config: DictConfig, settings: dict[str, Any], key: str, outcome: _Outcome
) -> dict[str, Any]:
    """Return the root attributes of a run's store; `settings` are those that name the run."""
    chain = outcome.chain
    choices = dict(config.get("choices") or {})
    ids = outcome.scene_ids
    cameras = outcome.cameras
    mixed = outcome.mixed
    return {
        "kind": "run",
        "key": key,
        "config": settings,
        "scene_id": ids[0] if ids else "",
        "scene_ids": ids,
        "scene": described(chain.scene),
        "choices": choices,
        "lighting": choices.get("lighting", config.lighting.name),
        "lens": choices.get("lens", config.lens.name),
        "weights": mixed.attrs["weights"],
        "versions_shown": outcome.versions_shown,
        "cameras": list(cameras),
        "lighting_notes": {
            k: v
            for k, v in mixed.attrs.items()
            if k in ("infeasible", "targets", "modulation") and v
        },
        "sensors": {name: type(chain.cameras[name]).__name__ for name in cameras},
        "objects": outcome.scene.attrs.get("objects", []),
        "lamps": outcome.scene.attrs.get("lamps", []),
        "scores": [
            {"camera": name, **asdict(score)}
            for name, camera in cameras.items()
            for score in camera.scores
        ],
        "warnings": [
            asdict(warning)
            for name, camera in cameras.items()
            for warning in warnings_of(name, camera.picture, camera.truth, camera.labels)
        ],
        "ledger": outcome.rows.as_records(),
        "versions": versions() | libraries(*chain.components(), frame=True),
        "kernels": kernels(*chain.components()),
        "code": fingerprint(*chain.components(), frame=True),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
