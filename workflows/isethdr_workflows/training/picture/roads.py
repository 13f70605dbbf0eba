"""Rendered roads of a dataset as a sensor's photocurrent and XYZ, through the lens of the config.

The focal length is chosen so that one pixel is one tile, and no detail is invented. The truth is
the light that reaches the sensor, including flares. A network sees too few pixels around each pixel
to distinguish veiling glare from a bright surface, so it could only guess the light without flares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.physics.photometry import luminance, xyz_weights
from isethdr_core.pipeline.chain.side_by_side import threads_for
from isethdr_core.plugins.registry import build, build_from_config
from isethdr_core.storage.home_folder import home
from isethdr_core.store import open_scene

from ...dataset.record import DEFINITION, SceneRecord, read_dataset, read_definition, read_scenes
from ...dataset.splits import part_of
from ...detection.threads import COMPOSING
from .camera import TrainingCamera

LEAST_ROADS = 2  # fewest roads to train on; a network would memorise a single road
VARIANTS = 2  # variants of each road: as it was drawn, and relit with the flares of the config
RELIT = 1.0  # standard deviation of the log weight of a light group, after all are equally bright
TRAIN = "train"
VALIDATION = "validation"
TEST = "test"


class Road(NamedTuple):
    """One stored scene."""

    record: SceneRecord
    path: Path  # path of its radiance


class Lit(NamedTuple):
    """A road under one light."""

    mixed: Any  # mixed radiance
    light: Any  # irradiance on the sensor plane
    scene: Any  # scene radiance with its labels


@dataclass(frozen=True, eq=False)
class Roads:
    """The stored scenes of a dataset, by part."""

    name: str
    parts: dict[str, tuple[Road, ...]]

    def of(self, part: str) -> tuple[Road, ...]:
        """Return the roads of a part."""
        return self.parts.get(part, ())


def roads_of(dataset: str) -> Roads:
    """Return the scenes of a dataset that are made.

    Parameters
    ----------
    dataset : name of a dataset in the home folder, or the folder of a dataset in another one, which
        is only read.

    Raises
    ------
    ConfigError : it has too few roads to train on, or no held-out road.
    CatalogError : there is no such dataset.
    """
    folder = Path(dataset) if "/" in dataset else home() / "datasets" / dataset
    if "/" in dataset and not (folder / DEFINITION).is_file():
        raise CatalogError(
            f"there is no dataset in {folder}; expected a folder with {DEFINITION}; type for"
            " example dataset=OTHER_HOME/datasets/NAME"
        )
    definition = read_definition(folder) if "/" in dataset else read_dataset(dataset)
    shares = definition.recipe.splits
    parts: dict[str, list[Road]] = {}
    for _, record in sorted(read_scenes(folder).items()):
        if record.stores:
            path = folder.parents[1] / "scenes" / f"{record.stores[0]}.zarr"
            parts.setdefault(part_of(record.road, shares), []).append(Road(record, path))
    found = Roads(definition.name, {part: tuple(roads) for part, roads in parts.items()})
    count = len({road.record.road for road in found.of(TRAIN)})
    if count < LEAST_ROADS or not found.of(VALIDATION):
        raise ConfigError(
            f"the dataset {definition.name!r} has {count} roads to train on and"
            f" {len(found.of(VALIDATION))} that are held out; expected at least {LEAST_ROADS} and"
            f" 1; type for example isethdr dataset generate {definition.name} count=40"
        )
    return found


def lit(road: Road, camera: TrainingCamera, overrides: Sequence[str], variant: int = 0) -> Lit:
    """Return a road under its own light, or relit, on the sensor plane.

    Parameters
    ----------
    road : stored scene.
    camera : camera; the focal length is such that one of its pixels is one tile.
    overrides : overrides of the config, after those of the scene; its lens and flares are used.
    variant : 0 is the light that was drawn, through a clean lens; others have light groups in
        other proportions, and odd ones also the flares of the config.
    """
    return lit_scene(open_scene(road.path), road.record, camera, overrides, variant)


def lit_scene(
    scene: Any,
    record: SceneRecord,
    camera: TrainingCamera,
    overrides: Sequence[str],
    variant: int = 0,
) -> Lit:
    """Return the radiance of a road under its own light, or relit, on the sensor plane.

    Parameters
    ----------
    scene : radiance of the road, as stored or changed.
    record : record of the road's scene.
    camera, overrides, variant : as in `lit`.
    """
    with COMPOSING:
        config = compose([*record.overrides, *overrides])
    lighting = build_from_config("lighting", config.lighting)
    if variant:
        rng = np.random.default_rng([record.number, variant])
        lighting = build("lighting", "weights", weights=relit_weights(scene, rng))
    mixed = lighting(scene)
    tiles = round(mixed.attrs["field_width"] / mixed.attrs["pitch_x"])
    focal_mm = 1e-3 * camera.sensor.pitch_um * tiles / mixed.attrs["field_width"]
    lens = build_from_config("lens", config.lens)
    lens = replace(lens, focal_length_mm=focal_mm, falloff="none")
    wanted = config.get("flare") or {} if variant % 2 else {}
    flares = tuple(build_from_config("flare", value) for value in wanted.values() if value)
    return Lit(mixed, lens(mixed, flares=flares) if flares else lens(mixed), scene)


def threads_of(road: Road, overrides: Sequence[str]) -> int:
    """Return how many threads may call `lit` at the same time: one if the lighting, the lens or a
    flare does not declare `THREAD_SAFE`.

    Parameters
    ----------
    road : stored scene.
    overrides : overrides of the config, after those of the scene.
    """
    config = compose([*road.record.overrides, *overrides])
    nodes = (config.get("flare") or {}).values()
    flares = [build_from_config("flare", node) for node in nodes if node]
    lighting = build_from_config("lighting", config.lighting)
    return threads_for([lighting, build_from_config("lens", config.lens), *flares])


def relit_weights(scene: Any, rng: np.random.Generator) -> dict[str, float]:
    """Return random weights of light groups, with which all groups are about equally bright.

    Parameters
    ----------
    scene : scene radiance.
    rng : generator of the random numbers.
    """
    weights = {}
    for name in scene.light_group.values:
        y = luminance(scene.radiance.sel(light_group=name).values, scene.wavelength.values)
        bright = float(np.percentile(y, 95))  # a percentile, so that lamps in view do not count
        weights[str(name)] = float(np.exp(rng.normal(0.0, RELIT))) / bright if bright > 0 else 0.0
    return weights


def planes_of(view: Lit, camera: TrainingCamera) -> np.ndarray:
    """Return the planes (plane, y, x) of a road, scaled to a mean illuminance of 1 lux in which
    lamps are clipped. The overscan is cut off.

    Parameters
    ----------
    view : road under one light.
    camera : camera with the filters.
    """
    wavelength_nm = view.light.wavelength.values
    weights = camera.plane_weights(wavelength_nm)[:-3]
    electrons = np.tensordot(weights, view.light.values, axes=1)
    truth = np.tensordot(xyz_weights(wavelength_nm), view.light.values, axes=1)
    planes = cropped(np.concatenate([electrons, truth]), view.mixed)
    y = planes[-2]
    level = np.minimum(y, np.percentile(y, 95)).mean()
    return np.maximum(planes / level, 0.0).astype(np.float32)


def cropped(planes: np.ndarray, mixed: Any) -> np.ndarray:
    """Return planes (plane, y, x) without overscan.

    Parameters
    ----------
    planes : planes with overscan.
    mixed : mixed radiance, for the camera's field.
    """
    counts = (
        round(mixed.attrs["field_height"] / mixed.attrs["pitch_y"]),
        round(mixed.attrs["field_width"] / mixed.attrs["pitch_x"]),
    )
    first = [(have - want) // 2 for have, want in zip(planes.shape[1:], counts, strict=True)]
    return planes[:, first[0] : first[0] + counts[0], first[1] : first[1] + counts[1]]


def render_noise(road: Road, overrides: Sequence[str]) -> float:
    """Return the median over tiles of the relative standard error of their luminance; NaN if the
    scene states no noise.

    Parameters
    ----------
    road : stored scene.
    overrides : overrides of the config, after those of the scene.
    """
    scene = open_scene(road.path)
    if "xyz_noise" not in scene:
        return float("nan")
    config = compose([*road.record.overrides, *overrides])
    mixed = build_from_config("lighting", config.lighting)(scene)
    variance = sum(
        (weight * scene["xyz_noise"].sel(light_group=name).values[1]) ** 2
        for name, weight in mixed.attrs["weights"].items()
    )
    y = luminance(mixed.values, mixed.wavelength.values)
    return float(np.median(np.sqrt(variance) / np.maximum(y, np.finfo(float).tiny)))
