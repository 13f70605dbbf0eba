"""Summary: counts, luminances, noise, time and bytes of the scenes; duplicates and outliers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_catalog.dataset import is_thing

from isethdr_core.config.composition import compose
from isethdr_core.data.quantities import tristimulus
from isethdr_core.display import display_view
from isethdr_core.pipeline.chain import chain
from isethdr_core.storage import store

from .record import SceneRecord

if TYPE_CHECKING:
    import xarray as xr

# limits of the classes of distance (m) and of height in the picture (pixels)
DISTANCES_M = (15.0, 30.0, 60.0)
HEIGHTS = (16.0, 32.0, 64.0)
LUX = (0.1, 1.0, 10.0, 100.0, 1000.0)  # limits of the classes of illuminance, lx
DAY = ("lighting=day",)
SKY = "sky"  # the light group that lights a scene by day
NOISY = 0.5  # noise of a tile over its light, from which on the tile counts as mostly noise
THUMBNAIL = 240  # width of a thumbnail, pixels
# decades of luminance of a histogram, cd/m2: from a moonless sky to a lamp
DECADES = np.arange(-6.0, 8.0)
# robust standard deviations of the logarithm from the median, beyond which a scene is an outlier
OUTLIER = 5.0
# standard deviation over median absolute deviation of a normal distribution
SCALE = 1.4826


@dataclass(frozen=True)
class ClassCounts:
    """The objects of one class."""

    category: str
    scenes: int  # number of scenes that show at least one of them
    objects: int
    by_distance: tuple[int, ...]  # below 15, 30, 60 m, and beyond
    by_height: tuple[int, ...]  # below 16, 32, 64 pixels, and above
    by_lux: tuple[int, ...]  # below 0.1, 1, 10, 100, 1000 lx, and above; all 0 if not known


@dataclass(frozen=True)
class Look:
    """Pictures and luminances of one scene."""

    record: SceneRecord
    own: np.ndarray  # picture under the lighting of the recipe, uint8 (y, x, 3)
    day: np.ndarray | None  # picture by day; None if it is mostly noise, as in a tunnel
    weights: dict[str, float]  # weights of the light groups under the lighting of the recipe
    histograms: dict[str, np.ndarray]  # {light group: number of tiles in each decade} at weight 1
    mean_cd_m2: float  # mean luminance under the lighting of the recipe


@dataclass(frozen=True)
class Outlier:
    """A scene that differs much from the others in one property."""

    number: int
    what: str
    value: float
    median: float


def class_counts(
    records: Iterable[SceneRecord], weights: Mapping[int, Mapping[str, float]] | None = None
) -> list[ClassCounts]:
    """Return the counts of visible objects, the most frequent class first. Surfaces, plants and the
    camera's own car, which may show its lamps, do not count as objects.

    Parameters
    ----------
    records : records of the scenes.
    weights : {number of a scene: weights of its light groups}; None: illuminance is not counted.
    """
    entries = [
        (record.number, entry)
        for record in records
        for entry in record.objects
        if is_thing(entry["category"])
        and entry.get("visible_fraction", 1.0) > 0
        and entry.get("box")
    ]
    counts = []
    for category, total in Counter(e["category"] for _, e in entries).most_common():
        own = [(number, e) for number, e in entries if e["category"] == category]
        lux = [illuminance(e, weights[number]) for number, e in own] if weights else []
        counts.append(
            ClassCounts(
                category,
                len({number for number, _ in own}),
                total,
                _binned([e["distance_m"] for _, e in own], DISTANCES_M),
                _binned([e["box"][3] for _, e in own], HEIGHTS),
                _binned([v for v in lux if not math.isnan(v)], LUX),
            )
        )
    return counts


def illuminance(row: Mapping[str, Any], weights: Mapping[str, float]) -> float:
    """Return the vertical illuminance of an object towards the camera under a lighting, lx; NaN if
    the scene states none.

    Parameters
    ----------
    row : row of the table of objects.
    weights : {light group: weight} of the lighting.
    """
    if "illuminance_lx" not in row:
        return math.nan
    return math.fsum(lux * weights.get(group, 0.0) for group, lux in row["illuminance_lx"].items())


def bounds(limits: Sequence[float], unit: str) -> list[str]:
    """Return the names of the classes between limits: `below 15 m`, `15 to 30 m`, `from 60 m`.

    Parameters
    ----------
    limits : rising limits between the classes.
    unit : unit of the limits.
    """
    between = [f"{a:g} to {b:g} {unit}" for a, b in zip(limits, limits[1:], strict=False)]
    return [f"below {limits[0]:g} {unit}", *between, f"from {limits[-1]:g} {unit}"]


def _binned(values: Sequence[float], limits: Sequence[float]) -> tuple[int, ...]:
    places = np.searchsorted(limits, np.asarray(values, float), side="right")
    return tuple(int(n) for n in np.bincount(places, minlength=len(limits) + 1))


def look(record: SceneRecord, view: Callable[[object], np.ndarray]) -> Look:
    """Return pictures and luminances of a stored scene, under its own lighting and by day.

    Parameters
    ----------
    record : record of the scene, with its stores.
    view : function that maps xyz (y, x, 3) in cd/m2 to displayed values (y, x, 3), uint8.
    """
    scene = inside(store.open_scene(record.stores[0]))
    mixed = chain(compose(record.overrides), rendered=True).lighting(scene)
    own = tristimulus(mixed)
    day = None
    if not mostly_noise(scene, SKY):
        lighting = chain(compose([*record.overrides, *DAY]), rendered=True).lighting
        day = view(thumbnail(tristimulus(lighting(scene)).xyz.values))
    histograms = {}
    for group in scene.light_group.values:
        luminance = display_view.luminance(tristimulus(scene.radiance.sel(light_group=group)))
        histograms[str(group)] = by_decade(luminance)
    return Look(
        record,
        view(thumbnail(own.xyz.values)),
        day,
        dict(mixed.attrs["weights"]),
        histograms,
        float(display_view.luminance(own).mean()),
    )


def mostly_noise(scene: xr.Dataset, group: str) -> bool:
    """Return whether a picture of one light group would mostly show noise: in most tiles, the group
    has no light, or the noise is at least `NOISY` times the light. A scene without this group, or
    without stated noise, does not count as noise.

    Parameters
    ----------
    scene : stored scene radiance.
    group : name of the light group.
    """
    if "xyz_noise" not in scene or group not in scene.light_group.values:
        return False
    light = display_view.luminance(tristimulus(scene.radiance.sel(light_group=group)))
    noise = scene["xyz_noise"].sel(light_group=group).isel(xyz_channel=1).values
    return bool((noise >= NOISY * light).mean() > 0.5)


def by_decade(luminance: np.ndarray) -> np.ndarray:
    """Return the number of lit tiles in each decade of `DECADES`.

    Tiles outside the range of the decades count in the nearest one, so that no lit tile is lost.

    Parameters
    ----------
    luminance : luminance of the tiles, cd/m2.
    """
    lit = np.log10(luminance[luminance > 0])
    return np.histogram(np.clip(lit, DECADES[0], DECADES[-1]), DECADES)[0]


def inside(scene: xr.Dataset) -> xr.Dataset:
    """Return scene radiance without the overscan around the camera's field."""
    half_x = scene.attrs["field_width"] / 2
    half_y = scene.attrs["field_height"] / 2
    return scene.sel(x=slice(-half_x, half_x), y=slice(-half_y, half_y)).load()


def thumbnail(xyz: np.ndarray) -> np.ndarray:
    """Return xyz (y, x, 3) averaged over blocks of tiles, about 240 blocks wide."""
    block = max(1, round(xyz.shape[1] / THUMBNAIL))
    height, width = (n // block * block for n in xyz.shape[:2])
    blocks = xyz[:height, :width].reshape(height // block, block, width // block, block, 3)
    return blocks.mean(axis=(1, 3))


def duplicates(records: Iterable[SceneRecord]) -> list[list[int]]:
    """Return groups of numbers of scenes that share their radiance, because the recipe drew the
    same settings.
    """
    numbers: dict[tuple[str, ...], list[int]] = {}
    for record in records:
        numbers.setdefault(record.stores, []).append(record.number)
    return [same for same in numbers.values() if len(same) > 1]


def outliers(looks: Sequence[Look]) -> list[Outlier]:
    """Return the scenes with a time, size, noise or mean luminance far from the median.

    Far means more than five robust standard deviations of the logarithm. Fewer than five scenes
    have no outliers.
    """
    properties = {
        "seconds": [look.record.seconds for look in looks],
        "bytes": [float(look.record.stored_bytes) for look in looks],
        "largest noise of a group": [
            max(look.record.noise.values(), default=0.0) for look in looks
        ],
        "mean luminance, cd/m2": [look.mean_cd_m2 for look in looks],
    }
    found = []
    for what, values in properties.items():
        for place in far(values):
            median = float(np.median(values))
            found.append(Outlier(looks[place].record.number, what, values[place], median))
    return found


def far(values: Sequence[float]) -> list[int]:
    """Return the indices of the values with a logarithm far from the median of the logarithms."""
    positive = np.maximum(np.asarray(values, float), 1e-300)
    if positive.size < 5:
        return []
    logs = np.log(positive)
    offsets = np.abs(logs - np.median(logs))
    deviation = SCALE * np.median(offsets)
    return [int(k) for k in np.flatnonzero(offsets > OUTLIER * deviation)] if deviation > 0 else []
