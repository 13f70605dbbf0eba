"""Scenes of the published ISETHDR deposit: one EXR file of spectral radiance per light group.

| module            | what                                                   |
|-------------------|--------------------------------------------------------|
| `iset_exr`        | the component: which files, which groups, which labels |
| `iset_exr_files`  | the files: EXR radiance and instance maps, MAT maps    |
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import CatalogError, ConfigError, UnitError, did_you_mean
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.ranges import check_ranges
from isethdr_core.quantities import centres, scene_radiance

from . import iset_exr_files as files
from .iset_exr_files import is_deposit_file
from .limits import FileField, Luminance

if TYPE_CHECKING:
    import xarray as xr

FILES = {
    "sky": "skymap",
    "headlights": "headlights",
    "streetlights": "streetlights",
    "other": "otherlights",
}


@dataclass(frozen=True)
class IsetExr:
    """A scene of the published ISETHDR deposit, read from its folder of EXR files."""

    THREAD_SAFE: ClassVar[bool] = True

    folder: str = "."  # folder with <scene_id>_skymap.exr, _headlights.exr, ..., <scene_id>.mat
    scene_id: str = ""  # month, day, hour, minute and second, for example 1112184733
    # full horizontal field angle, which the files do not state
    horizontal_field_deg: FileField = 40.0
    # mean luminance to which each group is scaled (ISET: 100); 0 keeps absolute radiance
    normalise_cd_m2: Luminance = 0.0

    def __post_init__(self) -> None:
        check_ranges(self)
        if "\0" in self.folder:
            raise ConfigError(f"folder is {self.folder!r}; expected the path of a folder")
        if not re.fullmatch(r"[\w-]*", self.scene_id):
            raise ConfigError(
                f"scene_id is {self.scene_id!r}; expected letters, digits, _ and -; "
                "type for example scene.scene_id=1112184733"
            )

    def input_files(self) -> tuple[Path, Path, Path, Path]:
        """Return the files of the scene. Their content is part of a run's name.

        Raises
        ------
        CatalogError : no file of the scene is there.
        """
        files_of_scene = sorted(Path(self.folder).expanduser().glob(f"{self.scene_id}_*.exr"))
        if not files_of_scene:
            raise self._missing()
        return tuple(path for path in files_of_scene if is_deposit_file(path))

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups that have a file.

        Raises
        ------
        CatalogError : no file of the scene is there.
        """
        return tuple(self._light_files())

    def check_files(self) -> None:
        """Check the names of the channels and the map of distances; no radiance is read.

        Raises
        ------
        CatalogError : the scene has no file, a file cannot be read, or a band is missing or there
            twice.
        UnitError : the map of distances does not hold distances.
        """
        for path in self._light_files().values():
            files.check_channels(path)
        path = self._path(".mat")
        if files.is_deposit_file(path):
            with suppress(LookupError):  # a scene may lack the map, which the ledger then states
                files.read_distance(path)

    def _light_files(self) -> dict[str, Path]:
        """Return the existing files of radiance, by light group."""
        paths = {group: self._path(f"_{name}.exr") for group, name in FILES.items()}
        present = {group: path for group, path in paths.items() if files.is_deposit_file(path)}
        if not present:
            raise self._missing()
        return present

    def __call__(self) -> xr.Dataset:
        """Return scene radiance, W m-2 sr-1 nm-1, with the labels `distance` and `instance` where
        they can be read.

        Raises
        ------
        CatalogError : the scene has no file, or a file is cut off or lacks a channel.
        UnitError : light in a file is negative or not finite, or two files differ in size or
            wavelengths.
        """
        files_by_group = self._light_files()
        # the deposit leaves out groups without a lamp
        for group in [g for g in FILES if g not in files_by_group]:
            missing = self._path(f"_{FILES[group]}.exr")
            ledger.left_out(f"group {group}", f"no file {missing.name}", 0.0, "cd/m2")
        ledger.error(
            2.0**-24,
            "relative",
            "bound",
            "rounding to float32; the files do not state their noise",
        )
        bands = None
        cube = None
        for k, path in enumerate(files_by_group.values()):
            nm, light = files.read_radiance(path)
            if cube is None:
                bands = nm
                cube = np.empty((len(files_by_group), *light.shape), np.float32)
            if light.shape != cube.shape[1:] or not np.array_equal(nm, bands):
                raise UnitError(
                    f"{path.name} has {light.shape[2]} x {light.shape[1]} tiles and {len(nm)}"
                    f" bands, the files before it {cube.shape[3]} x {cube.shape[2]} and"
                    f" {len(bands)}; expected one grid; fetch the scene again"
                )
            cube[k] = light * self._scale(light, nm) if self.normalise_cd_m2 else light
        height, width = cube.shape[2:]
        field = 2 * math.tan(math.radians(self.horizontal_field_deg) / 2)
        ds = scene_radiance(
            cube,
            files_by_group,
            bands,
            centres(width, field),
            centres(height, field * height / width),
            (field, field * height / width),
            **self._labels((height, width)),
        )
        # no `lamps`: the deposit does not say where they are
        ds.attrs.update(scene_id=self.scene_id, objects=[])
        return ds

    def _scale(self, light: np.ndarray, nm: np.ndarray) -> float:
        mean = float(luminance(light, nm).mean())
        return self.normalise_cd_m2 / mean if mean > 0 else 1.0

    def _labels(self, shape: tuple[int, int]) -> dict:
        labels = {}
        for label, suffix, read in (
            ("instance", "_instanceID.exr", files.read_instance),
            ("distance", ".mat", files.read_distance),
        ):
            path = self._path(suffix)
            if not files.is_deposit_file(path):
                ledger.left_out(f"label {label}", f"no file {path.name}", 0.0, "cd/m2")
                continue
            try:
                values = read(path)
            except LookupError as err:
                ledger.left_out(f"label {label}", f"{path.name} {err}", 0.0, "cd/m2")
                continue
            # ISET attaches full-size maps to cropped scenes; here that is an error
            if values.shape != shape:
                raise UnitError(
                    f"{path.name} holds a {label} map of {values.shape[1]} x {values.shape[0]}"
                    f" tiles, the radiance has {shape[1]} x {shape[0]}; expected the same; fetch"
                    f" the scene again, or move {path.name} away"
                )
            labels[label] = values
        return labels

    def _path(self, suffix: str) -> Path:
        return Path(self.folder).expanduser() / f"{self.scene_id}{suffix}"

    def _missing(self) -> CatalogError:
        folder = Path(self.folder).expanduser()
        if not folder.is_dir():
            return CatalogError(
                f"{folder} is not a folder; type scene.folder=<folder with the deposit's files>"
            )
        extensions = {
            p.name.split("_")[0] for name in FILES.values() for p in folder.glob(f"*_{name}.exr")
        }
        return CatalogError(
            f"{folder} has no EXR file of scene"
            f" {self.scene_id!r}{did_you_mean(self.scene_id, extensions)}; type scene.scene_id=<id>"
        )
