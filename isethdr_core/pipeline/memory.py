"""Memory: the arrays of a run, compared with the memory of the machine before the run starts.

Scenes, renderers, lenses and sensors may state how much memory they will use (`protocols`). Other
components count as 0.
"""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from ..errors import ConfigError, PluginError
from ..plugins.protocols import (
    CountsKernels,
    CountsMemory,
    CountsPixels,
    CountsTiles,
    KnowsImageSize,
    KnowsItsField,
)

FLOAT32_BYTES = 4
STEP = 0.9  # ratio between the sizes of frames that are tried one after the other
CUBES = 2  # spectral cubes in memory at a time: scene radiance, and the light from it
OWN_GROUPS = Path("/proc/self/cgroup")  # the control groups of this process
CONTROL_GROUPS = Path("/sys/fs/cgroup")  # where Linux shows all control groups


@dataclass(frozen=True)
class Frame:
    """The tiles of a scene's light and their bands."""

    rows: int
    columns: int
    pitch: tuple[float, float]  # (y, x) size of a tile, in the projection's unit
    wavelength_nm: tuple[float, ...]  # band centres
    # whether sensors state their noise, so that a lens may leave out light below it
    sensed: bool
    # whether there may be lamps, much brighter than the rest, as in scenes that are rendered
    lamps: bool = False


class Need(NamedTuple):
    """One or more arrays of a run: a description, the number of bytes, and a setting that needs
    less.
    """

    what: str
    size_bytes: float
    advice: str


def check_run(
    source: Any,
    scene: Any,
    lens: Any,
    flares: Sequence[Any],
    sensors: Sequence[Any],
    frame: Frame | None,
) -> None:
    """Refuse a run if its frame, lens or pixels exceed the memory of the machine.

    Parameters
    ----------
    source : the source of the radiance: the renderer, or the scene itself.
    scene : scene of the run.
    lens : lens of the run.
    flares : flare models of the run.
    sensors : sensors of all cameras.
    frame : the tiles and bands that are needed; None if they are not known in advance.

    Raises
    ------
    ConfigError : the memory is too small. The message states the bytes needed, the bytes available,
        and what to type.
    """
    light = _light_needs(source, lens, flares, frame) if frame is not None else []
    check_fits(light)
    if isinstance(scene, KnowsItsField) and isinstance(lens, KnowsImageSize):
        size_m = lens.image_size_m(*scene.camera_field())
        for sensor in sensors:
            if isinstance(sensor, CountsPixels):
                check_fits([*light[:1], sensor.pixel_need(*size_m)])


def frame_of(
    source: Any, scene: Any, wavelength_nm: Sequence[float] | None, margin: bool, sensed: bool
) -> Frame | None:
    """Return the frame that a renderer or scene will make; None if it does not state one.

    Parameters
    ----------
    source : the source of the radiance: the renderer, or the scene itself.
    scene : scene of the run.
    wavelength_nm : (band,) band centres that are needed, nm; None if they are not known.
    margin : whether tiles beyond the camera's field are counted.
    sensed : whether sensors state their noise, so that a lens may leave out light below it.
    """
    if wavelength_nm is None or not (
        isinstance(source, CountsTiles) and isinstance(scene, KnowsItsField)
    ):
        return None
    width, height, _ = scene.camera_field()
    rows, columns = source.tile_counts(margin=False)
    return Frame(
        *source.tile_counts(margin),
        (height / rows, width / columns),
        tuple(wavelength_nm),
        sensed,
        lamps=source is not scene,
    )


def check_fits(needs: Sequence[Need]) -> None:
    """Refuse arrays that are held at the same time if together they exceed the machine's memory.
    The message names the largest of them.
    """
    most = machine_bytes()
    total = sum(need.size_bytes for need in needs)
    if total <= most:
        return
    worst = max(needs, key=lambda need: need.size_bytes)
    other_arrays = (
        f" and the other arrays {total - worst.size_bytes:.3g} bytes" if len(needs) > 1 else ""
    )
    raise ConfigError(
        f"{worst.what} would take {worst.size_bytes:.3g} bytes ({worst.size_bytes / 2**30:.3g}"
        f" GiB){other_arrays}; expected at most the {most:.3g} bytes ({most / 2**30:.3g} GiB) of"
        f" this machine; {worst.advice}"
    )


def machine_bytes() -> float:
    """Return the memory that this process may use: the least of the machine's memory, the limits of
    its control groups, and its own limit; inf if none is known.
    """
    limits = [math.inf]
    with suppress(AttributeError, ValueError, OSError):  # no such figure on this system
        limits.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for path in group_limits():
        with suppress(OSError, ValueError):  # ValueError: "max"
            limits.append(int(path.read_text()))
    with suppress(ImportError):
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            limits.append(limit)
    return float(min(limits))


def group_limits() -> list[Path]:
    """Return the files with the memory limits of this process's control groups, which need not
    exist.

    A limit of a group holds for the groups in it. A job of SLURM or a service of systemd has its
    limit in a group below the root; a container sees its own group as the root.
    """
    own = {"": "/", "memory": "/"}  # {controllers: group}; version 2 names no controllers
    with suppress(OSError, ValueError):
        for line in OWN_GROUPS.read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            own |= {name: group for name in controllers.split(",") if name in own}
    return [
        CONTROL_GROUPS / folder / above.relative_to("/") / name
        for group, folder, name in (
            (own[""], "", "memory.max"),
            (own["memory"], "memory", "memory.limit_in_bytes"),
        )
        for above in (PurePosixPath(group), *PurePosixPath(group).parents)
    ]


def _light_needs(source: CountsTiles, lens: Any, flares: Sequence[Any], frame: Frame) -> list[Need]:
    """Return the memory of a frame's light, and of the arrays that the lens holds in addition."""
    bands = len(frame.wavelength_nm)
    tiles = f"{frame.rows} x {frame.columns} tiles"
    cubes = cube_bytes(frame)
    lens_bytes = held_bytes(lens, flares, frame)
    exceeds = cubes + sum(lens_bytes.values()) > machine_bytes()
    advice = _smaller(source, lens, flares, frame) if exceeds else ""
    return [
        Need(f"the light of {tiles} in {bands} bands", cubes, advice),
        *(
            Need(f"{array} of {bands} bands over {tiles}", size, advice)
            for array, size in lens_bytes.items()
        ),
    ]


def cube_bytes(frame: Frame) -> float:
    """Return the bytes of the spectral cubes of a frame that are held at a time."""
    return float(CUBES * FLOAT32_BYTES * len(frame.wavelength_nm) * frame.rows * frame.columns)


def held_bytes(lens: Any, flares: Sequence[Any], frame: Frame) -> Mapping[str, float]:
    """Return {description: bytes} of the arrays that a lens holds in addition to the light; empty
    if it states none.

    Parameters
    ----------
    lens : lens of the run.
    flares : flare models of the run.
    frame : tiles and bands of the light.

    Raises
    ------
    PluginError : the lens returns no dictionary.
    """
    if isinstance(lens, CountsMemory):
        held = lens.held_bytes(frame, flares)
        if not isinstance(held, Mapping):
            raise PluginError(
                f"{type(lens).__name__}.held_bytes() returned {held!r}; expected {{description:"
                " bytes}; type for example `return {'ray tables': 1e6}`"
            )
        return held
    if isinstance(lens, CountsKernels):
        name = type(lens).__name__
        warnings.warn(
            f"{name}.kernel_bytes is now held_bytes; return {{what: bytes}} instead of a number",
            FutureWarning,
            stacklevel=2,
        )
        return {f"arrays of the lens {name}": lens.kernel_bytes(frame, flares)}
    return {}


def _smaller(source: CountsTiles, lens: Any, flares: Sequence[Any], frame: Frame) -> str:
    """Return the settings of a smaller frame of the same field that fits. It is found by trial,
    because part of a lens's memory does not grow with the frame.
    """
    kind = "scene" if isinstance(source, KnowsItsField) else "renderer"
    nominal = source.tile_counts(margin=False)
    most = machine_bytes()
    scale = 1.0
    while scale * min(nominal) > 2:
        scale *= STEP
        rows, columns = (math.ceil(n * scale) for n in (frame.rows, frame.columns))
        smaller = replace(
            frame,
            rows=rows,
            columns=columns,
            pitch=(frame.pitch[0] / scale, frame.pitch[1] / scale),
        )
        lens_bytes = held_bytes(lens, flares, smaller)
        if cube_bytes(smaller) + sum(lens_bytes.values()) <= most:
            break
    rows, columns = (math.floor(n * scale) for n in nominal)
    return (
        f"type {kind}.width={columns} {kind}.height={rows}, or a larger {kind}.step_nm for fewer"
        " bands"
    )
