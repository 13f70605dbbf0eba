"""Traffic of a user: a route file on the net of the road, or a configuration of SUMO."""

from __future__ import annotations

import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError, did_you_mean

from ...roads.network import Network
from ...roads.opendrive.elements import Node, opened, unpacked
from ...roads.profile import Floats
from ...things.stock import Stock
from ...things.thing import Thing
from .configuration import copy_that_reads, named_files, value_of
from .demand import AFTER_S
from .lane_below import LanesBelow
from .lights import PROGRAM_FILE, STATES_FILE, Heeded, Lights, read_lights
from .net import NET, SumoNet, net_of
from .net import read as read_net
from .program import call, version
from .trace import STEP_S, Journey, read, seconds

CONFIGURATION = ".sumocfg"
ROUTES = (".xml", ".xml.gz")  # a route file
DRAWS = 8  # number of things drawn from a group; the one nearest in size is taken
ON_LANE_M = 2.5  # a vehicle farther from a lane's middle is not on the lane
LEAST_SHARE = 0.5  # least share of vehicles on lanes of the road; else the net is another one's
# names that no file of a user has: files that additional files name are written to the same folder
TRACE = "isethdr.trace.xml"
TRIPS = "isethdr.trips.xml"
COPY = "traffic.rou.xml"  # name of the changed copy of a route file
UP = "../" * 64  # leads from any folder to the topmost one
DATE = "TIME"  # SUMO replaces this word in a prefix by the date
OTHER_FOLDER = Path("/tmp")  # for temporary files, if the path of the usual folder contains `DATE`
DAY_S = 86_400.0  # time in which vehicles are looked for
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


class _Source(NamedTuple):
    """What SUMO simulates."""

    arguments: tuple[str, ...]  # arguments of its command line
    offset_m: Floats  # (2,) offset from the coordinates of the roads to those of SUMO
    begin_s: float = 0.0  # seconds of the simulation
    end_s: float = np.inf


class _Reported(NamedTuple):
    """Report of one run of SUMO."""

    journeys: dict[str, Journey]  # journeys by vehicle
    states: bytes  # content of the file with the states of traffic lights; empty without any


def files_of(path: Path) -> tuple[Path, ...]:
    """Return a file of traffic and the files that it names."""
    if path.suffix != CONFIGURATION or not path.is_file():
        return (path,)
    top = opened(path, "configuration", "a configuration of SUMO (.sumocfg)")
    kinds = ("net-file", "route-files", "additional-files")
    return (path, *(named for kind in kinds for named in named_files(top, kind)))


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
    CatalogError : a file is missing or of another format; the routes are of another network; SUMO
        ends with an error.
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
        raise ConfigError(_nobody(path, net, second_s, seed, program))
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
    with _temporary() as name:
        folder = Path(name)
        source = _source(path, net, int(str(_made_of[0])), program, folder)
        begin = max(second_s - 2 * STEP_S, 0.0)
        told = [f"--fcd-output={TRACE}", f"--device.fcd.begin={begin:.1f}", *OPTIONS]
        if not _simulate(path, source, second_s + AFTER_S, told, folder):
            return _Reported({}, b"")
        trace = _written(folder / TRACE, path)
        states = (folder / STATES_FILE).read_bytes() if program else b""
        return _Reported(read(trace, source.offset_m), states)


def _source(
    path: Path, net: SumoNet | None, seed: int, program: _Program | None, folder: Path
) -> _Source:
    """Return what SUMO simulates, and put files for it into a folder."""
    if net is None:
        top = opened(path, "configuration", "a configuration of SUMO (.sumocfg)")
        own_net = named_files(top, "net-file")
        if not own_net:
            raise top.error("it names no net-file; expected one")
        offset = read_net(_content(own_net[0])).offset_m
        start = max(_stated_s(top, "begin", 0.0), 0.0)
        end = _stated_s(top, "end", -1.0)
        arguments = [f"--configuration-file={copy_that_reads(path, folder)}"]
        return _Source(tuple(arguments), offset, start, end if end >= 0 else np.inf)
    (folder / NET).write_bytes(net.content)
    arguments = [
        f"--net-file={NET}",
        f"--route-files={path.resolve() if program is None else COPY}",
    ]
    arguments += [f"--seed={seed % 2**31}", f"--step-length={STEP_S}", "--begin=0"]
    # the net has no pavements; people of the file walk on lanes, and drivers do not see them
    arguments += ["--pedestrian.model=nonInteracting"]
    if program is not None:
        (folder / PROGRAM_FILE).write_bytes(program.content)
        (folder / COPY).write_bytes(stopping_at(path, program.stop_gap_m))
        arguments.append(f"--additional-files={PROGRAM_FILE}")
    return _Source(tuple(arguments), net.offset_m)


def _simulate(
    path: Path, source: _Source, until_s: float, told: Sequence[str], folder: Path
) -> bool:
    """Run SUMO in a folder up to a second, and return whether there was anything to simulate.

    Files that routes and additional files of the user name as output go into the same folder.
    """
    until = min(source.end_s, until_s)
    if until <= source.begin_s:
        return False
    # SUMO puts the prefix between the folder and the name of each file that detectors, edgeData and
    # devices of vehicles write. This one leads to the given folder, so that results of the user
    # keep their content.
    away = f"{UP}{folder.relative_to(folder.anchor).as_posix()}/"
    try:
        call(
            "sumo",
            [*source.arguments, f"--end={until:.1f}", f"--output-prefix={away}", *told],
            folder,
        )
    except CatalogError as error:
        expected = (
            "routes on the net of this road: `isethdr roads net ROAD roads.net.xml` writes it"
            if path.suffix != CONFIGURATION
            else f"a configuration that SUMO simulates without an error: type sumo -c {path}"
        )
        raise CatalogError(f"{path}: {error}; expected {expected}") from None
    return True


def _written(file: Path, path: Path) -> Path:
    """Return a file that SUMO was told to write, and raise CatalogError if it is not there."""
    if not file.is_file():
        raise CatalogError(
            f"{path}: SUMO {version()} ended without an error, but wrote no {file.name}; expected"
            " this file; install another version of SUMO, or type scene.traffic=sumo"
        )
    return file


def _temporary() -> tempfile.TemporaryDirectory[str]:
    """Return a new folder whose path SUMO takes as a prefix as it is.

    Raises
    ------
    ConfigError : there is no such folder.
    """
    usual = Path(tempfile.gettempdir())
    if DATE not in str(usual):
        return tempfile.TemporaryDirectory(dir=usual)
    if OTHER_FOLDER.is_dir() and os.access(OTHER_FOLDER, os.W_OK):
        return tempfile.TemporaryDirectory(dir=OTHER_FOLDER)
    raise ConfigError(
        f"the folder for temporary files is {usual}, but SUMO replaces {DATE} in its path by the"
        f" date; expected a path without {DATE}; set TMPDIR to such a folder"
    )


def _content(path: Path) -> bytes:
    """Return the content of a file of SUMO, which may be packed by gzip."""
    return unpacked(path.read_bytes())


def _stated_s(top: Node, name: str, usual_s: float) -> float:
    """Return a second that a configuration states, or the usual one."""
    text = value_of(top, name)
    if not text:
        return usual_s
    try:
        return seconds(text)
    except ValueError:
        raise top.error(f"its {name} is {text!r}; expected seconds, or hh:mm:ss") from None


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


def _nobody(
    path: Path, net: SumoNet | None, second_s: float, seed: int, program: _Program | None
) -> str:
    """Return the message for a second at which no vehicle is on the road."""
    said = (
        f"scene.traffic_start_s is {second_s:g}, but no vehicle of {path} is on the road at that"
        " second"
    )
    there = _trips(path, net, second_s, seed, program)
    if not len(there):
        return (
            f"{said}, and none enters it within {DAY_S / 3600:g} hours; expected a vehicle; type"
            " another file, or scene.traffic=sumo"
        )
    return (
        f"{said}; the first one enters at second {there[:, 0].min():.8g} and the last one leaves at"
        f" second {there[:, 1].max():.8g}; expected a second with a vehicle; type for example"
        f" scene.traffic_start_s={_busiest_s(there):.8g}"
    )


def _trips(
    path: Path, net: SumoNet | None, second_s: float, seed: int, program: _Program | None
) -> Floats:
    """Return the seconds (n, 2) at which each vehicle enters and leaves the road."""
    with _temporary() as name:
        folder = Path(name)
        source = _source(path, net, seed, program, folder)
        told = [f"--tripinfo-output={TRIPS}", "--tripinfo-output.write-unfinished", *OPTIONS]
        if not _simulate(path, source, max(second_s, source.begin_s) + DAY_S, told, folder):
            return np.zeros((0, 2))
        nodes = ET.parse(_written(folder / TRIPS, path)).iter("tripinfo")
        pairs = [(seconds(n.get("depart", "-1")), seconds(n.get("duration", "0"))) for n in nodes]
    found = np.array(pairs).reshape(-1, 2)
    found = found[(found[:, 0] >= 0) & (found[:, 1] > 0)]
    return np.stack([found[:, 0], found.sum(1)], 1)


def _busiest_s(trips: Floats) -> float:
    """Return the second in the middle of a trip at which most vehicles are on the road."""
    middles = trips.mean(1)
    entered = np.searchsorted(np.sort(trips[:, 0]), middles, side="right")
    left = np.searchsorted(np.sort(trips[:, 1]), middles, side="left")
    return float(np.round(middles[np.argmax(entered - left)], 1))


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
