"""Export job: the pictures to write, the folder, and the list of files written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.cli.progress import track
from isethdr_core.sequence.exposure import NODE
from isethdr_core.storage.store import content_hash

if TYPE_CHECKING:
    import xarray as xr
    from isethdr_catalog.selection import StoredShot

    from isethdr_core.runs.run import Result

PNG_FOLDER = "png"


@dataclass(frozen=True)
class Item:
    """One picture to write: a camera of a stored run."""

    number: int  # from 1, in the order of sequences, times, keys and cameras
    shot: StoredShot
    run: Result = field(compare=False, repr=False)  # the stored run
    sequence: int = 1  # number of its sequence, from 1

    @property
    def camera(self) -> str:
        """The name of the camera."""
        return self.shot.camera

    @property
    def key(self) -> str:
        """The key of the run."""
        return self.shot.path.stem

    @property
    def name(self) -> str:
        """The name of its files, without an ending."""
        return f"{self.key}_{self.camera}"

    @property
    def png(self) -> str:
        """The path of its PNG in the folder, which labels and cards mention."""
        return f"{PNG_FOLDER}/{self.name}.png"

    @property
    def attributes(self) -> dict[str, Any]:
        """All recorded attributes of the run."""
        return self.run.attributes

    @property
    def moment(self) -> dict[str, float]:
        """`time_s` of the scene and `frames_per_s` of its sequence, as far as it has them."""
        scene = self.attributes["config"]["scene"]
        found = {name: scene.get(name) for name in ("time_s", "frames_per_s")}
        return {name: float(value) for name, value in found.items() if value is not None}

    @property
    def time_s(self) -> float:
        """The time of its scene, s; 0 if the scene has none."""
        return self.moment.get("time_s", 0.0)

    @property
    def frame(self) -> dict[str, float]:
        """The number of its sequence, and its `moment`; empty if the scene has no time."""
        moment = self.moment
        return {"sequence": self.sequence, **moment} if "time_s" in moment else moment

    @cached_property
    def settings(self) -> str:
        """The digest of the settings of its run that all frames of a sequence share: all but the
        time and the exposures that were carried into the frame. A run into which no exposures are
        carried is no frame of `isethdr sequence`, and has another digest than such a frame.
        """
        carried = self.attributes["config"].get(NODE) is not None
        config = {key: node for key, node in self.attributes["config"].items() if key != NODE}
        config[NODE] = carried
        scene = {key: value for key, value in config["scene"].items() if key != "time_s"}
        return content_hash(config | {"scene": scene})

    def picture(self) -> xr.Dataset:
        """Return the picture. Its arrays are read when they are used."""
        return self.run.open(f"picture/{self.camera}")

    def truth(self) -> xr.Dataset:
        """Return the reference picture with the labels of its pixels. Arrays are read when they are
        used.
        """
        return self.run.open(f"truth/{self.camera}")

    def captures(self) -> xr.Dataset:
        """Return the raw captures. Their arrays are read when they are used."""
        return self.run.open(f"captures/{self.camera}")

    @cached_property
    def size(self) -> tuple[int, int]:
        """The number of rows and of columns of the picture."""
        picture = self.picture()
        return picture.sizes["y"], picture.sizes["x"]


@dataclass(frozen=True)
class Written:
    """One file of an export."""

    path: str  # path below the folder, with /
    format: str
    media_type: str
    run: str = ""  # key of the run; "" if the file is about several runs
    camera: str = ""
    sequence: int | None = None  # number of its sequence; None if the scene has no time
    time_s: float | None = None  # time of the scene; None if it has none


@dataclass
class Job:
    """One export: its pictures, its folder, and its files so far."""

    items: Sequence[Item]
    scenes: Sequence[Path]  # stores of radiance, if a query selected scenes
    folder: Path  # a temporary folder, which is renamed when the export is complete
    title: str
    licence: str  # "" if none is stated
    created: str  # time of the export, ISO 8601
    files: list[Written] = field(default_factory=list)
    format: str = ""  # name of the format that is being written

    def each(self) -> Iterator[Item]:
        """Yield the pictures, and show the progress on a terminal."""
        return track(self.items, self.format)

    def new_file(self, path: str, media_type: str, item: Item | None = None) -> Path:
        """Return the full path of a new file, make its folder, and add it to the list of files.

        Parameters
        ----------
        path : path below the folder of the export, with /.
        media_type : media type of its content.
        item : the picture that the file belongs to; None: several pictures or none.
        """
        written = Written(path, self.format, media_type)
        if item is not None:
            time_s = item.moment.get("time_s")
            sequence = None if time_s is None else item.sequence
            written = replace(
                written, run=item.key, camera=item.camera, sequence=sequence, time_s=time_s
            )
        self.files.append(written)
        full = self.folder / path
        full.parent.mkdir(parents=True, exist_ok=True)
        return full

    def write_json(self, path: str, content: Mapping[str, Any], media_type: str = "") -> None:
        """Write a JSON file with UTF-8 text. NaN is not allowed in JSON and raises ValueError.

        Parameters
        ----------
        path : path below the folder of the export, with /.
        content : content that JSON can hold.
        media_type : media type of its content; "" is application/json.
        """
        text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        self.new_file(path, media_type or "application/json").write_text(text, encoding="utf-8")


def sha256(path: Path) -> str:
    """Return the digest of a file as 64 hex digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
