"""Find which files of a tree belong to which scene of the deposit, and which to no scene."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from ..iset_exr import FILES

INSTANCE = "_instanceID.exr"
MAPS = ".mat"
_RADIANCE = re.compile(rf"(?P<id>[\w-]+)_(?:{'|'.join(FILES.values())})\.exr")


@dataclass(frozen=True)
class FoundScene:
    """The files of one scene, in one folder."""

    folder: Path
    scene_id: str
    files: tuple[Path, ...]

    def stamps(self) -> dict[str, list[int]]:
        """Return the size in bytes and the change time in ns of each file, by name."""
        status = {path.name: path.stat() for path in self.files}
        return {name: [s.st_size, s.st_mtime_ns] for name, s in status.items()}


@dataclass(frozen=True)
class Skipped:
    """A file that belongs to no scene, and the reason."""

    path: Path
    why: str


def scan(root: Path) -> tuple[list[FoundScene], list[Skipped]]:
    """Return the scenes and the other files in a folder and in all folders below it, by path.

    Links to folders are not followed, so each scene is found once.
    """
    scenes = []
    skipped = []
    for folder, folders, names in os.walk(root):
        folders.sort()
        here = Path(folder)
        ids = {match["id"] for name in names if (match := _RADIANCE.fullmatch(name))}
        belongs: dict[str, list[Path]] = {scene_id: [] for scene_id in sorted(ids)}
        for name in sorted(names):
            scene_id = _scene_of(name)
            if scene_id in belongs:
                belongs[scene_id].append(here / name)
            else:
                skipped.append(Skipped(here / name, _why(name)))
        scenes += [FoundScene(here, scene_id, tuple(paths)) for scene_id, paths in belongs.items()]
    return scenes, skipped


def _scene_of(name: str) -> str:
    """Return the id of the scene that a file of this name belongs to; "" for no scene.

    A scene exists only if it also has files of radiance.
    """
    if match := _RADIANCE.fullmatch(name):
        return match["id"]
    for ending in (INSTANCE, MAPS):
        if name.endswith(ending):
            return name.removesuffix(ending)
    return ""


def _why(name: str) -> str:
    if name.endswith(INSTANCE):
        return "instance map without radiance beside it"
    if name.endswith(MAPS):
        return "MATLAB file without radiance beside it"
    if name.endswith(".exr"):
        return "EXR file with another name than <id>_<group>.exr"
    return "no file of a scene"
