"""Scenes of a dataset through the cameras: exposures, and the frames that the observer sees.

Mean electrons are proportional to the light, so other levels of light need no imaging.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from isethdr_isp.demosaic.interpolation import array_period
from isethdr_isp.develop import plain_development
from isethdr_isp.development_fields import Development
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_scenes.sky.state import sky_state

from isethdr_core import generator
from isethdr_core.config.composition import compose
from isethdr_core.data.camera_geometry import projection_of
from isethdr_core.data.derived_once import values_only
from isethdr_core.data.quantities import tristimulus
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.physics.optics.projection import direction
from isethdr_core.pipeline.chain import Chain, stage
from isethdr_core.pipeline.shot import CameraShot, Shot, developed
from isethdr_core.plugins.presets import presets
from isethdr_core.runs.result_names import named
from isethdr_core.runs.reuse import Kept
from isethdr_core.truth import labels_on, truth
from isethdr_core.uncertainty.ledger import Ledger
from isethdr_core.uncertainty.render_noise import relative_halves

from ..dataset.record import SceneRecord
from ..dataset.summary import illuminance
from .exposing import Exposing, exposing, in_darkness
from .frame import Boxes, Frame, Layout, SceneObjects, Thing, boxes, cells, kind_of, owners_of
from .lit_scene import lit
from .stabilising import Stabiliser, readings

LAMP_CD_M2 = 1000.0  # least luminance of a lamp that counts as bright
LAMP_DEG = 3.0  # largest angle between an object's middle and a lamp near it
LOW_SUN = "low sun"
LOW_SUN_DEG = 15.0  # a sun up to this height is in the picture of a camera that looks ahead
UNIFORM = "uniform"  # kind of sky with one luminance everywhere, at any hour
AS_BUILT = "ideal"  # the lighting that leaves each light group as the scene was built
TRANSFER = "detection"  # key of the metric in the config
HALF_DIFFERENCE = "relative_half_difference"  # variable (y, x) of a prepared scene


class CameraName(NamedTuple):
    """A camera as it is typed: `split_pixel` or `split_pixel:LPLG+SPLG`."""

    text: str
    sensor: str
    captures: tuple[str, ...]


@dataclass(eq=False)
class Prepared:
    """A scene under one lighting, imaged by the lens."""

    record: SceneRecord
    condition: str
    built: Chain
    scene: xr.Dataset
    light: xr.DataArray
    mean_lux: float  # mean illuminance on the sensor
    weights: Mapping[str, float]  # weights of the light groups
    near_lamp: frozenset[int]  # instances with a bright lamp within 3 degrees
    transfer: dict[str, dict[str, float]] = field(default_factory=dict)  # {camera: {object: score}}
    _pixels: dict[tuple[Any, ...], Pixels] = field(default_factory=dict)

    def pixels(self, picture: xr.Dataset, period: tuple[int, int]) -> Pixels:
        """Return the objects on the pixels of `picture`. Cameras with the same pixels share them,
        so they must not be changed.

        Parameters
        ----------
        picture : coordinates y and x of the pixels, and the attributes of the captures.
        period : rows and columns of pixels in a cell.
        """
        pitch = picture.attrs.get("pitch_um")
        key = picture.y.values.tobytes(), picture.x.values.tobytes(), str(pitch), period
        if key not in self._pixels:
            labels = labels_on(self.scene[["instance"]], picture)
            objects = labels.attrs["objects"]
            owners = owners_of(labels["instance"].values, objects)
            height, width = (size // side for size, side in zip(owners.shape, period, strict=True))
            # one pixel of each cell; a copy, so that the labels of the others are freed
            owners = owners[:: period[0], :: period[1]][:height, :width].copy()
            self._pixels[key] = Pixels(objects, Layout(owners), boxes(owners))
        return self._pixels[key]


class Pixels(NamedTuple):
    """The objects on the pixels of a camera."""

    objects: list[dict[str, Any]]  # table of the objects
    layout: Layout
    boxes: Boxes


def camera_names(text: str) -> list[CameraName]:
    """Return the cameras that a setting names, separated by commas.

    Raises
    ------
    ConfigError : no camera is named.
    """
    found = []
    for part in filter(None, (name.strip() for name in text.split(","))):
        sensor, _, captures = part.partition(":")
        found.append(CameraName(part, sensor, tuple(filter(None, captures.split("+")))))
    if not found:
        raise ConfigError(
            "cameras is empty; expected names of cameras; type for example"
            " cameras=bayer,split_pixel,rgbw"
        )
    return found


def overrides_of(cameras: Sequence[CameraName]) -> list[str]:
    """Return the overrides that add the cameras that the main config lacks.

    Raises
    ------
    ConfigError : a name is neither a camera of the config nor a preset of a sensor.
    """
    own = list(compose([]).cameras)
    known = [*own, *presets("sensor")]
    overrides = []
    for name in dict.fromkeys(camera.sensor for camera in cameras):
        if name not in known:
            raise ConfigError(
                f"there is no camera {name!r}{did_you_mean(name, known)}; type for example"
                " cameras=bayer,split_pixel"
            )
        if name not in own:
            overrides.append(f"+sensor@cameras.{name}={name}")
    return overrides


def prepared(
    record: SceneRecord,
    overrides: Sequence[str],
    transfer: Sequence[str],
    bare: bool = False,
) -> Prepared:
    """Return a stored scene, imaged by the lens of its config.

    Parameters
    ----------
    record : record of the scene; its radiance is stored.
    overrides : overrides of all scenes, after those of the scene itself.
    transfer : names of the cameras for which contrast transfer accuracy is computed too.
    bare : whether the same view without people, riders and animals is used.
    """
    seen = lit(record, overrides, bare)
    scene = seen.scene
    mixed = seen.mixed
    light = seen.light
    xyz = tristimulus(mixed)
    luminance = xyz.xyz.values[..., 1].astype(float)
    within = inside(scene)
    difference = relative_halves(scene, mixed)
    kept = scene[["instance"]].load()  # the other labels would take five times the memory
    if difference is not None:
        kept[HALF_DIFFERENCE] = (("y", "x"), difference)
    ready = Prepared(
        record=record,
        condition=condition_of(seen.config),
        built=seen.built,
        scene=kept,
        light=light,
        mean_lux=float(luminance[within].mean()) * float(light.attrs["throughput_sr"]),
        weights=dict(mixed.attrs["weights"]),
        near_lamp=near_lamps(scene, luminance),
    )
    shot = seen.shot(generator(scene=record.road))
    for name in transfer:
        ready.transfer[name] = transfer_accuracy(seen.built, seen.rows, name, shot)
    return ready


def condition_of(config: Any) -> str:
    """Return the kind of light of a composed config: the first word of its lighting, for example
    night, dusk, day or tunnel, or `low sun` if the scene's own sky is used and has a sun at most 15
    degrees high.
    """
    choices = config.get("choices") or {}
    name = str(choices.get("lighting") or config.lighting.name).split("_")[0]
    preset = config.scene.get("sky", UNIFORM)
    if name == AS_BUILT and preset != UNIFORM:
        sun_deg = sky_state(preset, config.scene.get("hour") or {}).sun_elevation_deg
        if 0 < sun_deg <= LOW_SUN_DEG:
            return LOW_SUN
    return name


def inside(scene: xr.Dataset) -> tuple[slice, slice]:
    """Return the rows and columns of a scene that lie in the camera's field."""
    cuts = []
    for dim, full in (("y", "field_height"), ("x", "field_width")):
        kept = np.flatnonzero(np.abs(scene[dim].values) <= scene.attrs[full] / 2)
        cuts.append(slice(int(kept[0]), int(kept[-1]) + 1))
    return cuts[0], cuts[1]


def near_lamps(scene: xr.Dataset, luminance: np.ndarray) -> frozenset[int]:
    """Return the instances with a lamp of 1000 cd/m2 or more within 3 degrees of their middle.

    Parameters
    ----------
    scene : scene radiance with its labels, objects and lamps.
    luminance : (y, x) luminance of the tiles, cd/m2.
    """
    instance = scene["instance"].values
    lamps = {int(lamp["instance"]) for lamp in scene.attrs.get("lamps", [])}
    shines = (luminance >= LAMP_CD_M2) & np.isin(instance, list(lamps))
    y, x = np.meshgrid(scene.y.values, scene.x.values, indexing="ij")
    rays = np.moveaxis(direction(x, y, projection_of(scene)), 0, -1)
    bright = rays[shines]
    of = instance[shines]
    near = set()
    for row in scene.attrs.get("objects", []):
        number = int(row["instance"])
        own = instance == number
        if kind_of(row) and own.any() and len(bright):
            middle = rays[own].mean(0)
            cosines = bright[of != number] @ (middle / np.linalg.norm(middle))
            if cosines.size and cosines.max() >= np.cos(np.radians(LAMP_DEG)):
                near.add(number)
    return frozenset(near)


def transfer_accuracy(built: Chain, rows: Ledger, name: str, shot: Shot) -> dict[str, float]:
    """Return the contrast transfer accuracy of each object, as `contrast_detection` defines it.

    Parameters
    ----------
    built : components of the run.
    rows : ledger that gets the row of the metric.
    name : name of the camera.
    shot : light on the sensor plane.
    """
    metric = built.metrics.get(TRANSFER)
    if metric is None:
        return {}
    isp = built.isp
    if isinstance(metric, ContrastDetection) and isinstance(isp, Development):
        isp = plain_development(isp)  # the metric reads the picture before denoising
    camera = CameraShot(shot, built.cameras[name], isp)

    def scores() -> list[Any]:
        captures = camera.sensor(shot.light, shot.generator)
        picture = developed(isp, captures)
        labels = asked_labels(shot.scene, picture)
        with values_only():
            return metric(picture, truth(shot.mixed, picture), labels)

    # a name of their own, because the scores of a run are of all objects and have intervals
    of_run = camera.kept_scores(metric)
    kept = Kept(shot.reuse, of_run.name and named("of the five classes", of_run.name))
    found = stage(rows, "metric", TRANSFER, metric, scores, kept)
    return {score.object: float(score.value) for score in found if score.object}


def asked_labels(scene: xr.Dataset, picture: xr.Dataset) -> xr.Dataset:
    """Return the labels on the pixels of `picture`, with the objects of the five classes alone.
    Other objects do not change their scores.

    Parameters
    ----------
    scene : scene radiance with its labels and objects.
    picture : picture of a camera.
    """
    entries = scene.attrs.get("objects", [])
    # a metric numbers objects of the same name in their order, so all objects of a name are kept
    names = {str(entry["name"]) for entry in entries if kind_of(entry)}
    asked = [entry for entry in entries if str(entry["name"]) in names]
    numbers = [int(entry["instance"]) for entry in asked]
    instance = scene["instance"]
    known = xr.Dataset(
        {"instance": instance.where(instance.isin(numbers), 0).astype(instance.dtype)},
        attrs={**scene.attrs, "objects": asked},
    )
    return labels_on(known, picture)


@dataclass(eq=False)
class View:
    """A scene through one camera, before a level of light is chosen. Light on the pixels and labels
    are kept only where frames are read.

    Parameters
    ----------
    picture : coordinates y and x of the pixels, and the attributes of the captures.
    cell : (y, x) channel of each pixel of a cell.
    peak_e : (capture,) electrons of light of the brightest pixel at the sensor's own exposure.
    dark_e : (capture,) electrons of dark charge at that exposure.
    objects : table of the objects.
    layout : the road users in the cells.
    boxes : boxes of the road users, cells.
    exposing : chooses the exposure.
    """

    prepared: Prepared
    sensor: Any
    captures: tuple[str, ...]
    picture: xr.Dataset
    cell: np.ndarray
    peak_e: np.ndarray
    dark_e: np.ndarray
    objects: list[dict[str, Any]]
    layout: Layout
    boxes: Boxes
    exposing: Exposing
    _light_e: dict[tuple[int, int, int], np.ndarray] = field(default_factory=dict)
    _half: dict[tuple[int, int, int, int], np.ndarray] = field(default_factory=dict)

    def scene_objects(self, factor: float = 1.0) -> SceneObjects:
        """Return the objects under all light times `factor`."""
        record = self.prepared.record
        return SceneObjects(
            number=record.number,
            road=record.road,
            condition=self.prepared.condition,
            layout=self.layout,
            things=tuple(self._things(factor)),
        )

    def frame(self, factor: float, rows: slice = slice(None)) -> Frame:
        """Return the frame of the camera for all light times `factor`, at the exposure that the
        camera chooses for it.

        Parameters
        ----------
        factor : factor on the light.
        rows : rows of cells that are wanted.
        """
        few = self.exposing.captures(factor)
        stated = readings(few, self.captures)
        names = [str(name) for name in few["capture"].values]
        used = [k for k, name in enumerate(names) if not self.captures or name in self.captures]
        sensitivities = [reading.sensitivity.sum() for reading in stated.captures]
        best = used[int(np.argmax(sensitivities))]
        own_dark = self.dark_e[best]
        share = (
            float(few["dark_e"].values[best]) / own_dark
            if own_dark > 0
            else float(few["exposure_s"].values[best]) / self.sensor.exposure_s
        )
        scale = factor * share
        stabiliser = Stabiliser(stated, 2 * float(self.peak_e[best] * scale))
        start, stop, _ = rows.indices(self.layout.owners.shape[0])
        known = slice(start, stop)
        light_e = self._light_of(best, known)
        colours = np.full(
            (len(np.unique(self.cell)), *self.layout.owners.shape), np.nan, np.float32
        )
        colours[:, known] = cells(
            lambda down, across, channel: stabiliser(
                self._pixels(light_e, down, across) * scale, channel
            ),
            self.cell,
        )
        in_light = LightAtLevel(stabiliser, light_e, scale, start)
        with_halves = HALF_DIFFERENCE in self.prepared.scene
        return Frame(
            **vars(self.scene_objects(factor)),
            colours=colours,
            render=partial(self._render, in_light) if with_halves else None,
            rows=known,
        )

    def _light_of(self, capture: int, rows: slice) -> np.ndarray:
        """Return the electrons of light (y, x) of a capture in rows of cells, at the sensor's own
        exposure. The last rows are kept, because all levels of light need the same ones.
        """
        key = capture, rows.start, rows.stop
        if key not in self._light_e:
            high = self.cell.shape[0]
            mean_e = self.sensor.expected(self.prepared.light).values[capture]
            mean_e = mean_e[rows.start * high : rows.stop * high]
            self._light_e = {key: (mean_e - self.dark_e[capture]).clip(0).astype(np.float32)}
        return self._light_e[key]

    def _pixels(self, mosaic: np.ndarray, down: int, across: int) -> np.ndarray:
        """Return the pixels (y, x) at one row and column of all whole cells of a mosaic."""
        rows, columns = self.cell.shape
        height, width = (
            size // side for size, side in zip(mosaic.shape, self.cell.shape, strict=True)
        )
        return mosaic[down : height * rows : rows, across : width * columns : columns]

    def _render(self, in_light: LightAtLevel, rows: slice, columns: slice) -> np.ndarray:
        """Return half of the difference of half buffers (colour, y, x) in some cells, in the unit
        of the colours.

        Parameters
        ----------
        in_light : light on the pixels, and its stabilised values.
        rows : rows of cells.
        columns : columns of cells.
        """
        top, bottom, _ = rows.indices(self.layout.owners.shape[0])
        left, right, _ = columns.indices(self.layout.owners.shape[1])
        high, wide = self.cell.shape
        first = in_light.first_row
        light_e = in_light.light_e[
            (top - first) * high : (bottom - first) * high, left * wide : right * wide
        ]
        half = self._half_difference((top * high, bottom * high), (left * wide, right * wide))

        def changed(down: int, across: int, channel: int) -> np.ndarray:
            own_e = self._pixels(light_e, down, across) * in_light.scale
            own_half = self._pixels(half, down, across)
            values = in_light.stabiliser(own_e * (1 + own_half), channel)
            return values - in_light.stabiliser(own_e, channel)

        return cells(changed, self.cell).astype(np.float32)

    def _half_difference(self, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
        """Return the relative half difference of half buffers A and B in some pixels (y, x)."""
        key = *rows, *columns
        if key in self._half:
            return self._half[key]
        scene = self.prepared.scene[[HALF_DIFFERENCE]]
        scene.attrs = {**scene.attrs, "objects": []}
        part = self.picture.isel(y=slice(*rows), x=slice(*columns))
        half = labels_on(scene, part)[HALF_DIFFERENCE].values
        if len(part.x) < len(self.picture.x) // 2:  # whole rows would take much memory
            self._half[key] = half
        return half

    def _things(self, factor: float) -> list[Thing]:
        ready = self.prepared
        things = []
        for row in self.objects:
            kind = kind_of(row)
            box = self.boxes.get(int(row["instance"]))
            if not kind or box is None:
                continue
            things.append(
                Thing(
                    instance=int(row["instance"]),
                    name=str(row["name"]),
                    kind=kind,
                    distance_m=float(row["distance_m"]),
                    illuminance_lx=illuminance(row, ready.weights) * factor,
                    near_lamp=int(row["instance"]) in ready.near_lamp,
                    box=box,
                    height_px=float(box[2] * self.cell.shape[0]),
                )
            )
        return things


class LightAtLevel(NamedTuple):
    """Light on the pixels at one level of light, and the function that stabilises it."""

    stabiliser: Stabiliser
    light_e: np.ndarray  # (y, x) electrons of light at the sensor's own exposure
    scale: float  # factor on these electrons
    first_row: int  # first row of cells


def view(ready: Prepared, camera: CameraName, metered: xr.DataArray | None = None) -> View:
    """Return a prepared scene through a camera.

    Parameters
    ----------
    ready : scene, imaged by the lens.
    camera : camera and the captures that are used.
    metered : light for which the camera chooses its exposure; None: the light of the scene.
    """
    sensor = ready.built.cameras[camera.sensor]
    mean = sensor.expected(ready.light)
    if metered is None:
        exposure = exposing(sensor, ready.light, mean)
    else:
        exposure = exposing(sensor, metered)
    few = exposure.captures()
    readings(few, camera.captures)
    dark = in_darkness(sensor, ready.light)
    filters = few["filter"].values
    rows, columns = array_period(filters)
    picture = xr.Dataset(coords={"y": mean.y.values, "x": mean.x.values}, attrs=few.attrs)
    seen = ready.pixels(picture, (rows, columns))
    return View(
        prepared=ready,
        sensor=sensor,
        captures=camera.captures,
        picture=picture,
        cell=filters[:rows, :columns],
        peak_e=(mean.values.max((1, 2)) - dark).clip(0).astype(np.float32),
        dark_e=dark,
        objects=seen.objects,
        layout=seen.layout,
        boxes=seen.boxes,
        exposing=exposure,
    )
