"""The faces of a mesh that are lamps, with their intensities."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.scene import Lamp

from ...geometry.mesh.piece import unit
from ...lamps import lamp
from ...photometry.report import lamp_of
from .manifest import LampFaces

FACING = 0.5  # cosine: faces within 60 degrees of the axis emit
PER_M2 = ("shop_window", "panel")  # kinds with an intensity per square metre


def selected(
    form: LampFaces, names: tuple[str, ...], middles: np.ndarray, areas: np.ndarray
) -> np.ndarray:
    """Return which faces (m,) of a part emit.

    Parameters
    ----------
    form : selection of the lamp's faces by part, box and axis.
    names : names of the part.
    middles : (m, 3) middles of its faces, m.
    areas : (m, 3) vector areas of its faces, m2.
    """
    if form.part and form.part not in names:
        return np.zeros(len(middles), bool)
    on = unit(areas) @ unit(np.array(form.axis)) > FACING
    if form.box_m is not None:
        low, high = (np.array(end) for end in form.box_m)
        on &= ((middles >= low) & (middles <= high)).all(1)
    return np.asarray(on)


def emission(form: LampFaces, areas: np.ndarray, folder: Path) -> Lamp:
    """Return the lamp of emitting faces.

    Parameters
    ----------
    form : kind and axis of the lamp, and its intensity, luminance or beam.
    areas : (m, 3) vector areas of its faces, m2.
    folder : folder of the pack, with the file of its beam.

    Raises
    ------
    ConfigError : the file of its beam cannot be read.
    """
    made = lamp(form.kind, form.axis)
    projected = float(np.maximum(areas @ np.array(made.axis), 0).sum())
    if form.beam:
        pattern = lamp_of(str(folder / form.beam))
        return replace(made, table=pattern.table, intensity_cd=pattern.intensity_cd)
    if form.cd_m2 is not None:
        return replace(made, intensity_cd=form.cd_m2 * projected)
    if form.candela is not None:
        return replace(made, intensity_cd=form.candela)
    if form.kind in PER_M2:
        return replace(made, intensity_cd=made.intensity_cd * projected)
    return made


def check_beam(form: LampFaces, folder: Path) -> None:
    """Raise ConfigError unless the file of a lamp's beam can be read."""
    path = folder / form.beam
    if not path.is_file():
        raise ConfigError(f"there is no file {form.beam}; expected a path inside the pack")
    lamp_of(str(path))
