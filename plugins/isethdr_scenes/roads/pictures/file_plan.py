"""Plan of a road file: a drawing with ids, and a report of the file's content."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from PIL import ImageDraw

from isethdr_core.cli.terminal import number_of
from isethdr_core.errors import CatalogError

from ..markings import patches
from ..network import Network
from ..opendrive.file_road import Choices, content, no_start, start
from ..opendrive.gaps import GAP_M, STEP_M
from .from_above import CAR, PAINT, Canvas, draw_lanes, draw_structures

PIXELS = 1200
ROOM = 1.08  # side of the picture over that of the network
CAR_M = 0.012  # length of the camera's mark over the side of the picture
PAINTED_M = 500.0  # a larger picture shows no road markings


def draw(path: Path, out: Path) -> Path:
    """Draw the plan of a road file as a PNG, and return its path.

    Raises
    ------
    CatalogError : as `road_file.read`; or the picture cannot be written.
    """
    file = content(path)
    network = file.network
    ends = np.concatenate([r.line.points(np.linspace(0, r.length_m, 50)) for r in network.roads])
    low = ends.min(0)
    high = ends.max(0)
    size = float((high - low).max()) * ROOM + 20.0
    canvas = Canvas((low + high) / 2, size, PIXELS)
    for road in sorted(network.roads, key=lambda r: bool(r.structures)):
        draw_lanes(canvas, road)
    for road in network.roads:
        for patch in patches(road) if size < PAINTED_M else ():
            points = road.line.points(patch.st_m[..., 0], patch.st_m[..., 1])
            canvas.polygon(np.concatenate([points[:, 0], points[::-1, 1]]), PAINT[patch.colour])
        draw_structures(canvas, road)
    if not no_start(network):
        lane, along = start(file, path, Choices())
        pose = lane.at(along)
        mark = np.array([[0.0, -0.4], [0.0, 0.4], [1.0, 0.0]]) * max(CAR_M * size, 4.0)
        canvas.polygon(pose[:2, 3] + mark @ pose[:2, :2].T, CAR)
    image = canvas.shown()
    pen = ImageDraw.Draw(image)
    for road in network.roads:
        if not road.junction:
            at = road.line.points(road.length_m / 2)[None]
            x, y = canvas.at(at)[0]
            pen.text((x / canvas.FINER, y / canvas.FINER), road.name, fill=(0, 0, 160))
    pen.text((6, 4), f"{path.name}: {size:.0f} m wide; red: camera", fill=(0, 0, 0))
    try:
        image.save(out)
    except (OSError, ValueError) as error:
        raise CatalogError(f"{out} cannot be written ({error}); type a path.png") from None
    return out


def report(path: Path) -> list[str]:
    """Return lines about a road file: its content, gaps, and parts that are changed or left out.

    Raises
    ------
    CatalogError : as `road_file.read`: a gap is an error.
    """
    file = content(path)
    network = file.network
    length = sum(road.length_m for road in network.roads)
    types = Counter(lane.type for lane in network.lanes(tuple(_types(network))))
    records = sum(len(road.line.records) for road in network.roads)
    lines = [
        f"{path}: {number_of(len(network.roads), 'road')}, {length:.1f} m,"
        f" {number_of(records, 'geometry', 'geometries')},"
        f" {number_of(len(network.junctions), 'junction')}",
        "lanes: " + ", ".join(f"{count} {name}" for name, count in types.most_common()),
        "roads: " + ", ".join(f"{count} {name}" for name, count in _kinds(network)),
        f"gaps: none above {GAP_M:g} m in plan or {STEP_M:g} m in height",
    ]
    ends = [
        lane for lane in network.lanes() if not network.successors(lane.key) and lane.road.junction
    ]
    if ends:
        names = sorted({lane.road.name for lane in ends})
        lines.append(f"lanes that end inside a junction: on roads {', '.join(names)}")
    if file.geo_reference:
        lines.append(f"map projection: {file.geo_reference}")
    none = no_start(network)
    if none:
        lines.append(f"camera: {none}")
    else:
        lane, along = start(file, path, Choices())
        s = float(lane.along_road(along))
        lines.append(
            f"camera: scene.road_id={lane.road.name} scene.lane_id={lane.lane.number}"
            f" scene.s_m={s:.1f} (without a choice)"
        )
    return lines + [f"note: {note}" for note in file.notes]


def _types(network: Network) -> set[str]:
    return {lane.type for r in network.roads for section in r.sections for lane in section.lanes}


def _kinds(network: Network) -> list[tuple[str, int]]:
    return Counter(
        f"{road.type} {road.speed_limit_kmh:.0f} km/h" for road in network.roads
    ).most_common()
