"""Traffic of a user: a route file on the net of the road, or a configuration of SUMO."""

from __future__ import annotations

import gzip
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError, did_you_mean

from ...roads.network import Network
from ...roads.opendrive.elements import Node, opened
from ...roads.profile import Floats
from ...things.stock import Stock
from ...things.thing import Thing
from .demand import AFTER_S
from .lane_below import LanesBelow
from .lights import PROGRAM_FILE, STATES_FILE, Heeded, Lights, read_lights
from .net import NET, SumoNet, net_of
from .net import read as read_net
from .program import call, version
from .trace import STEP_S, Journey, read, seconds

CONFIGURATION = ".sumocfg"
ROUTES = ".xml"  # a route file
DRAWS = 8  # number of things drawn from a group; the one nearest in size is taken
ON_LANE_M = 2.5  # a vehicle farther from a lane's middle is not on the lane
LEAST_SHARE = 0.5  # least share of vehicles on lanes of the road; else the net is another one's
GZIP = b"\x1f\x8b"  # first bytes of packed files, such as town.net.xml.gz
TRACE = "trace.xml"
COPY = "traffic.rou.xml"  # name of the changed copy of a route file
USUAL_TYPE = "DEFAULT_VEHTYPE"  # type of vehicles that state none
STOP_GAP = "jmStoplineGap"  # attribute of a type: metres from the junction at which drivers stop
OPTIONS = (
    "--fcd-output.signals",
    "--fcd-output.acceleration",
    "--fcd-output.geo=false",
    "--precision=4",
    "--no-step-log",
    "--xml-validation=never",
    "--random=false",
)
# group of things of each vClass of SUMO, and default length, width and height of the class, m (from
# SUMO's documentation, Definition_of_Vehicles, Vehicle_Types, Routes: abstract vehicle classes)
CLASSES: dict[str, tuple[str, tuple[float, float, float]]] = {
    "passenger": ("car", (5.0, 1.8, 1.5)),
    "private": ("car", (5.0, 1.8, 1.5)),
    "taxi": ("car", (5.0, 1.8, 1.5)),
    "evehicle": ("car", (5.0, 1.8, 1.5)),
    "hov": ("car", (5.0, 1.8, 1.5)),
    "vip": ("car", (5.0, 1.8, 1.5)),
    "authority": ("car", (5.0, 1.8, 1.5)),
    "army": ("car", (5.0, 1.8, 1.5)),
    "ignoring": ("car", (5.0, 1.8, 1.5)),
    "emergency": ("car", (6.5, 2.16, 2.86)),
    "delivery": ("car", (6.5, 2.16, 2.86)),
    "truck": ("truck", (7.1, 2.4, 2.4)),
    "trailer": ("truck", (16.5, 2.55, 4.0)),
    "bus": ("bus", (12.0, 2.5, 3.4)),
    "coach": ("bus", (14.0, 2.6, 4.0)),
    "motorcycle": ("motorcycle", (2.2, 0.9, 1.5)),
    "moped": ("motorcycle", (2.1, 0.8, 1.7)),
    "bicycle": ("bicycle", (1.6, 0.65, 1.7)),
}


class Driven(NamedTuple):
    """Traffic of a user's file as SUMO simulated it, in the coordinates of the road file."""

    journeys: dict[str, Journey]  # journeys by vehicle
    lights: Lights | None  # traffic lights that drivers obey


class _Program(NamedTuple):
    """Traffic lights for SUMO."""

    content: bytes  # content of an additional file
    stop_gap_m: float  # distance from the junction at which the first driver stops


class _Reported(NamedTuple):
    """Report of one run of SUMO."""

    journeys: dict[str, Journey]  # journeys by vehicle
    states: bytes  # content of the file with the states of traffic lights; empty without any


def files_of(path: Path) -> tuple[Path, ...]:
    """Return a file of traffic and the files that it names."""
    if path.suffix != CONFIGURATION or not path.is_file():
        return (path,)
    top = opened(path, "configuration", "a configuration of SUMO (.sumocfg)")
    return (
        path,
        *(named for kind in ("net", "route", "additional") for named in _named(top, kind)),
    )


def _named(top: Node, kind: str) -> tuple[Path, ...]:
    """Return the files of one kind that a configuration names."""
    found = top.element.find(f".//{kind}-files")
    if found is None:
        found = top.element.find(f".//{kind}-file")
    value = "" if found is None else found.get("value", found.get("v", ""))
    return tuple(top.file.parent / name.strip() for name in value.split(",") if name.strip())


def driven(path: Path, network: Network, second_s: float, seed: int, heed: Heeded | None) -> Driven:
    """Return the journeys of the vehicles of a user's file after `second_s`, and the states of the
    traffic lights that they obey.

    Parameters
    ----------
    path : configuration of SUMO, or route file on the net that `isethdr roads net` writes.
    network : network of the road, in the coordinates of its file.
    second_s : second of the simulation from which journeys are kept, s.
    seed : seed of SUMO's random numbers.
    heed : signals of the road that drivers of a route file obey; None without signals. A
        configuration has the lights of its own net.

    Raises
    ------
    ConfigError : SUMO is not installed; no vehicle is on the road at that second.
    CatalogError : a file is missing or of another format; the routes are of another network.
    """
    for file in files_of(path):
        if not file.is_file():
            raise CatalogError(f"{file} is missing; {path} needs it as traffic of SUMO")
    stamps = tuple((str(file), file.stat().st_mtime_ns) for file in files_of(path))
    net = None
    program = None
    if path.suffix != CONFIGURATION:
        net = net_of(network, heed.junctions if heed else ())
        program = heed and _Program(heed.program(net), heed.stop_gap_m)
    found, states = _reported(path, net, second_s, (seed, version(), *stamps), program)
    if not any(one.present(second_s) for one in found.values()):
        raise ConfigError(_nobody(path, net, second_s, seed))
    below = LanesBelow(network)
    here = [one.at(second_s) for one in found.values() if one.present(second_s)]
    lanes = [below.at(state.front_m, state.heading_rad) for state in here]
    on = sum(lane is not None and abs(lane.aside_m) < ON_LANE_M for lane in lanes)
    if on < LEAST_SHARE * len(here):
        raise CatalogError(
            f"{path}: {len(here) - on} of {len(here)} vehicles are on no lane of the road at second"
            f" {second_s:g}; expected traffic on the net of this road: `isethdr roads net ROAD"
            " roads.net.xml` writes it"
        )
    return Driven(found, read_lights(states, net, network) if net and program else None)


@lru_cache(maxsize=4)
def _reported(
    path: Path,
    net: SumoNet | None,
    second_s: float,
    _made_of: tuple[object, ...],
    program: _Program | None = None,
) -> _Reported:
    seed = _made_of[0]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace = folder / TRACE
        begin = max(second_s - 2 * STEP_S, 0.0)
        told = [f"--fcd-output={trace}", f"--device.fcd.begin={begin:.1f}", *OPTIONS]
        if net is None:
            top = opened(path, "configuration", "a configuration of SUMO (.sumocfg)")
            own_net = _named(top, "net")
            if not own_net:
                raise top.error("it names no net-file; expected one")
            offset = read_net(_content(own_net[0])).offset_m
            last = _end_s(top)
            source = [f"--configuration-file={path.resolve()}"]
            until = min(last, second_s + AFTER_S)
        else:
            (folder / NET).write_bytes(net.content)
            offset = net.offset_m
            routes = path.resolve() if program is None else COPY
            source = [f"--net-file={folder / NET}", f"--route-files={routes}"]
            source += [f"--seed={int(str(seed)) % 2**31}", f"--step-length={STEP_S}", "--begin=0"]
            until = second_s + AFTER_S
        if program is not None:
            (folder / PROGRAM_FILE).write_bytes(program.content)
            (folder / COPY).write_bytes(stopping_at(path, program.stop_gap_m))
            source.append(f"--additional-files={PROGRAM_FILE}")
        try:
            call("sumo", [*source, f"--end={until:.1f}", *told], folder)
        except CatalogError as error:
            raise CatalogError(
                f"{path}: {error}; expected routes on the net of this road: `isethdr roads net ROAD"
                " roads.net.xml` writes it"
            ) from None
        states = (folder / STATES_FILE).read_bytes() if program else b""
        return _Reported(read(trace, offset) if trace.is_file() else {}, states)


def _content(path: Path) -> bytes:
    """Return the content of a file of SUMO, which may be packed by gzip."""
    content = path.read_bytes()
    return gzip.decompress(content) if content.startswith(GZIP) else content


def _end_s(top: Node) -> float:
    """Return the second at which a configuration ends; infinite if it states none."""
    end = top.element.find(".//end")
    if end is None:
        return np.inf
    text = end.get("value", end.get("v", "-1"))
    try:
        last = seconds(text)
    except ValueError:
        raise top.error(f"its end is {text!r}; expected seconds, or hh:mm:ss") from None
    return last if last >= 0 else np.inf


def stopping_at(path: Path, stop_gap_m: float) -> bytes:
    """Return a route file in which every vehicle type states the distance from a junction's lights
    at which the first driver stops; types that state one keep it.

    Parameters
    ----------
    path : route file.
    stop_gap_m : distance for the other types, m.

    Raises
    ------
    CatalogError : the file is no route file.
    """
    top = opened(path, "routes", "a route file of SUMO").element
    if all(node.get("id") != USUAL_TYPE for node in top.iter("vType")):
        top.insert(0, ET.Element("vType", id=USUAL_TYPE))
    for node in top.iter("vType"):
        if STOP_GAP not in node.attrib:
            node.set(STOP_GAP, f"{stop_gap_m:.2f}")
    return ET.tostring(top)


def _nobody(path: Path, net: SumoNet | None, second_s: float, seed: int) -> str:
    """Return the message for a second at which no vehicle is on the road."""
    before, _ = _reported(path, net, max(second_s - AFTER_S, 0.0), (seed, "before"))
    last = max((float(one.time_s[-1]) for one in before.values()), default=0.0)
    if not last:
        before, _ = _reported(path, net, 0.0, (seed, "first"))
        last = max((float(one.time_s[-1]) for one in before.values()), default=0.0)
    return (
        f"scene.traffic_start_s is {second_s:g}, but no vehicle of {path} is on the road at that"
        f" second; the last one before it was seen at second {last:g}; expected less; type for"
        f" example scene.traffic_start_s={last / 2:g}"
    )


def bodies(
    path: Path, journeys: Mapping[str, Journey], stock: Stock, seed: int
) -> dict[str, Thing]:
    """Return a thing for each vehicle: from the group of its class, nearest in size to its type.
    Vehicles whose class is no road vehicle are left out.

    Parameters
    ----------
    path : configuration of SUMO, or route file; its files state the types.
    journeys : journeys of the vehicles, by name.
    stock : families of things that may be drawn.
    seed : seed of the draw, together with the name of each vehicle.
    """
    types = _types(files_of(path))
    found = {}
    for name, journey in journeys.items():
        # types of distributions carry a suffix
        told = types.get(journey.type, types.get(journey.type.partition("@")[0], {}))
        group, size = CLASSES.get(told.get("vClass", "passenger"), ("", (0.0, 0.0, 0.0)))
        if not group:
            continue
        named = ("length", "width", "height")
        wanted = np.array([float(told.get(key, usual)) for key, usual in zip(named, size)])
        rng = np.random.default_rng([seed, crc32(name.encode())])
        drawn = [stock.draw(group, rng) for _ in range(DRAWS)]
        # a longer body would come nearer to others than SUMO allows
        fitting = [one for one in drawn if one.size_m[0] < wanted[0] + 0.2] or drawn
        off = [np.abs(np.array(one.size_m) - wanted).max() for one in fitting]
        found[name] = fitting[int(np.argmin(off))]
    return found


def _types(files: Iterable[Path]) -> dict[str, dict[str, str]]:
    """Return the attributes of all types of vehicles by name."""
    found = {}
    for file in files:
        if file.name.endswith((CONFIGURATION, ".net.xml", ".net.xml.gz")):
            continue
        for node in ET.fromstring(_content(file)).iter("vType"):
            found[node.get("id", "")] = dict(node.attrib)
    return found


def nearest(
    journeys: Mapping[str, Journey], things: Mapping[str, Thing], place_m: Floats, second_s: float
) -> str:
    """Return the car that is nearest to a plan point (2,) at a second.

    Parameters
    ----------
    journeys : journeys of the vehicles, by name.
    things : thing of each vehicle, by name.
    place_m : (2,) plan point in the coordinates of the journeys, m.
    second_s : second of the simulation, s.
    """
    here = [name for name in things if journeys[name].present(second_s)]
    cars = [name for name in here if things[name].group == "car"] or here
    away = lambda name: float(np.linalg.norm(journeys[name].at(second_s).front_m - place_m))
    return min(cars, key=away, default="")


def check_own(own: str, path: Path, journeys: Mapping[str, Journey], second_s: float) -> None:
    """Raise ConfigError if the vehicle for the camera is not on the road at a second.

    Parameters
    ----------
    own : name of the vehicle for the camera.
    path : file of the traffic, for the message.
    journeys : journeys of the vehicles, by name.
    second_s : second of the simulation, s.
    """
    here = [name for name, one in journeys.items() if one.present(second_s)]
    if own in here:
        return
    if not here:
        raise ConfigError(
            f"{path} has no car, truck, bus, motorcycle or bicycle on the road at second"
            f" {second_s:g} that could carry the camera; expected one; type another"
            " scene.traffic_start_s"
        )
    raise ConfigError(
        f"scene.traffic_ego is {own!r}, but {path} has no such vehicle on the road at second"
        f" {second_s:g}{did_you_mean(own, here)}; there are {len(here)}, for example"
        f" {', '.join(sorted(here)[:5])}; type for example scene.traffic_ego={sorted(here)[0]}"
    )
