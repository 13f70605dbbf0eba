"""Make the pairs that are missing: each scene is imaged once for each member of a pair."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

from isethdr_scenes.stored import Stored
from omegaconf import DictConfig

from isethdr_core.cli.terminal import duration
from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.pipeline.chain import Chain, chain, imaging, plan
from isethdr_core.pipeline.imaging_plan import labelled
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.runs.run import check_writable
from isethdr_core.runs.seeds import Generator, generator
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.uncertainty.ledger import Ledger

from .arrays import Sample, sample
from .card import CARD, card
from .exposures import exposed, varies
from .files import cannot_write, write_scene
from .reference import LABELS, reference
from .request import PairRequest
from .sources import Source, families, sources
from .terms import Member, check_added, check_pupil, members

DEFINITION = "pairs.json"
Tell = Callable[[str], None]


class Made(NamedTuple):
    """A folder of pairs."""

    folder: Path
    scenes: int  # number of scenes with pairs in the folder
    failed: tuple[tuple[str, str], ...]  # name of a scene, reason


def make_pairs(request: PairRequest, tell: Tell = print) -> Made:
    """Make the pairs that are missing, and the card.

    A scene with a folder is not made again. A scene that fails is named, and the other scenes are
    still made.

    Parameters
    ----------
    request : the requested pairs.
    tell : called with one line of text for each scene that is done.

    Raises
    ------
    ConfigError : a setting has a mistake, which is found before the first scene is imaged; the
        folder holds pairs of other settings; or all scenes failed.
    CatalogError : there is no such dataset or scene; or the folder cannot be written.
    """
    found = sources(request)
    silent: set[str] = set()
    for source in families(found):
        built = built_for(source)[1]
        members(built, request.blur)
        scene = built.scene()
        check_pupil(built, scene)
        check_added(built, scene)
        if request.shots:
            silent |= {name for name, sensor in built.cameras.items() if not varies(sensor)}
    if silent:
        tell(
            f"no array noisy_* for {', '.join(sorted(silent))}: without noise, all shots are equal"
        )
    folder = request.target
    check_writable(folder)
    begun(request, folder)
    check_same_scenes(found, folder)
    failed = []
    started = time.monotonic()
    computed = 0
    for place, source in enumerate(found, 1):
        line = f"scene {source.name}, {place} of {len(found)}: "
        if (folder / source.name).is_dir():
            tell(line + "written before")
            continue
        begun_s = time.monotonic()
        try:
            samples = samples_of(source, request)
        except CatalogError:
            raise
        except Exception as err:  # any component may fail on one scene; the other scenes go on
            failed.append((source.name, f"{type(err).__name__}: {err}".splitlines()[0]))
            tell(line + f"failed: {failed[-1][1]}")
            continue
        size = write_scene(folder, source.name, samples, request.format)
        computed += 1
        line += f"{time.monotonic() - begun_s:.0f} s, {size / 1e6:.1f} MB"
        left = len(found) - place
        if left:
            rate_s = (time.monotonic() - started) / computed
            line += f", about {duration(rate_s * left)} left"
        tell(line)
    there = [source for source in found if (folder / source.name).is_dir()]
    if there:
        first = json.loads(next((folder / there[0].name).glob("*.json")).read_text("utf-8"))
        _write(folder / CARD, card(request, first, len(there)))
    else:
        if [path.name for path in folder.iterdir()] == [DEFINITION]:
            shutil.rmtree(folder)  # the same command with corrected settings may use its name
        raise ConfigError(f"all scenes failed, the first one because: {failed[0][1]}")
    return Made(folder, len(there), tuple(failed))


def begun(request: PairRequest, folder: Path) -> None:
    """Write the settings of the pairs into a new folder, or check that a folder has the same ones.

    Parameters
    ----------
    request : the requested pairs.
    folder : folder of the pairs.

    Raises
    ------
    ConfigError : the folder holds pairs of other settings.
    CatalogError : the settings in the folder are damaged, or cannot be written.
    """
    held = {"folder", "scenes"}  # further scenes may be added to a folder
    wanted = {key: value for key, value in asdict(request).items() if key not in held}
    wanted["overrides"] = list(request.overrides)
    path = folder / DEFINITION
    if not path.exists():
        _write(path, json.dumps(wanted, indent=1))
        return
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as err:
        raise CatalogError(
            f"{path} is damaged ({err}); expected the file that `isethdr dataset pairs` writes;"
            " remove the folder and type the same command again"
        ) from None
    differing = [key for key in wanted if stored.get(key) != wanted[key]]
    if differing:
        key = differing[0]
        raise ConfigError(
            f"the folder {folder} holds pairs with {key}={stored.get(key)!r}, but {wanted[key]!r}"
            " was typed; expected the same settings, or another folder; type for example"
            f" folder={folder.name}_2"
        )


def check_same_scenes(found: Sequence[Source], folder: Path) -> None:
    """Check that the scenes in a folder are those of the dataset, which may have been made again
    with another recipe or seed.

    Parameters
    ----------
    found : scenes to make pairs of.
    folder : folder of the pairs.

    Raises
    ------
    ConfigError : the folder holds pairs of another scene of the same name.
    """
    for source in found:
        path = next((folder / source.name).glob("*.json"), None)
        if path is None:
            continue
        stored = json.loads(path.read_text(encoding="utf-8"))
        if stored.get("overrides") != list(source.overrides):
            raise ConfigError(
                f"the folder {folder} holds pairs of another scene {source.name}, whose dataset"
                " had another recipe or seed; expected the same scenes, or another folder; type"
                f" for example folder={folder.name}_2"
            )


def built_for(source: Source) -> tuple[DictConfig, Chain]:
    """Return the config and the chain of a scene. The chain reads stored radiance, it never
    renders.
    """
    config = compose(list(source.overrides))
    built = chain(config, rendered=True)
    known = replace(built, scene=Stored(source.store), renderer=None, versions={})
    return config, known


class Imaged(NamedTuple):
    """A scene through all members of a pair."""

    chain: Chain
    members: list[Member]
    mixed: Any  # mixed radiance
    scene: Any  # scene radiance with labels
    light: dict[str, Any]  # {member: light on the sensor plane}
    key: Generator  # key of the noise in a run of the scene


def imaged(source: Source, blur: bool) -> Imaged:
    """Return the light of all members of a pair on the sensor plane.

    Parameters
    ----------
    source : the scene.
    blur : whether blur is a term of its own.
    """
    config, built = built_for(source)
    return light_of(config, built, members(built, blur), source)


def light_of(config: DictConfig, built: Chain, wanted: Sequence[Member], source: Source) -> Imaged:
    """Return the light of some members on the sensor plane.

    Parameters
    ----------
    config, built : config and chain of the scene, as `built_for` returns them.
    wanted : members to image, with their lenses and flares.
    source : the scene; the key of the noise depends on it.
    """
    rows = Ledger()
    demand = plan(built, rows).with_labels(*LABELS)
    scene, _ = scene_radiance(built, demand, rows, config)
    mixed = labelled(built.lens, built.lighting(scene), scene)
    light = {
        member.name: imaging(
            replace(built, lens=member.lens, flares=member.flares), mixed, demand
        ).light()
        for member in wanted
    }
    key = generator(config.seed, config.device, source.store.split("-")[0])
    return Imaged(built, list(wanted), mixed, scene, light, key)


def samples_of(source: Source, request: PairRequest) -> list[Sample]:
    """Return the arrays and labels to write for a scene, one sample for each camera."""
    seen = imaged(source, request.blur)
    noise = {str(k): float(v) for k, v in seen.scene.attrs.get("noise", {}).items()}
    about = {
        "scene": source.name,
        "road": source.road,
        "store": source.store,
        "overrides": list(source.overrides),
        "weights": dict(seen.mixed.attrs["weights"]),
        "renderer_noise": noise,
        "members": [member.name for member in seen.members],
        "terms": [member.term for member in seen.members],
    }
    found = []
    for name, sensor in seen.chain.cameras.items():
        shots = request.shots if varies(sensor) else 0
        keys = [shot_key(seen.key, draw) for draw in range(max(1, shots))]
        taken = exposed(sensor, seen.members, seen.light, keys)
        if not shots:
            taken = replace(taken, noisy={})
        truth = reference(seen.mixed, seen.scene, taken.captures)
        found.append(sample(name, taken, truth, about))
    return found


def shot_key(key: Generator, draw: int) -> Generator:
    """Return the key of the noise of one shot, as in a run of the scene.

    Parameters
    ----------
    key : key of the noise of the run.
    draw : number of the shot, from 0.
    """
    return key.child(f"{key.scene} draw {draw}") if draw else key


def _write(path: Path, text: str) -> None:
    try:
        write_text(path, text)
    except OSError as err:
        raise cannot_write(path, err) from err
