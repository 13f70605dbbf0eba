"""Scores of held-out roads in the folder of a model, which figures of the same roads reuse."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from isethdr_core.storage.atomic_write import write_text

from .settings import SIGNS, Scores

FILE = "held_out_scores.csv"
KEYS = ("model_sha256", "overrides", "lux", "road")


class HeldOut(NamedTuple):
    """Scores of one road at one illuminance.

    Parameters
    ----------
    network : scores of the network.
    classical : each score by the classical setting that is best for it.
    """

    lux: float
    road: str
    network: Scores
    classical: Scores


def write(path: Path, made_with: tuple[str, str], rows: Iterable[HeldOut]) -> None:
    """Write the scores of a model.

    Parameters
    ----------
    path : file of the table, CSV.
    made_with : digest of the model, and the overrides, as `made_with` returns them.
    rows : scores of all roads and illuminances.
    """
    columns = [f"{kind}_{score}" for kind in ("network", "classical") for score in SIGNS]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*KEYS, *columns])
    for row in rows:
        values = [*row.network.values(), *row.classical.values()]
        writer.writerow([*made_with, row.lux, row.road, *values])
    write_text(path, text.getvalue())


def made_with(model: Path, overrides: Sequence[str]) -> tuple[str, str]:
    """Return the digest of a model's file, and the overrides of its camera as one text.

    Parameters
    ----------
    model : file of the model.
    overrides : overrides of the config, as typed.
    """
    return hashlib.sha256(model.read_bytes()).hexdigest(), " ".join(overrides)


def read(path: Path, of: tuple[str, str]) -> dict[tuple[float, str], HeldOut]:
    """Return the stored scores by illuminance and road. There are none if the file is missing, or
    if it belongs to another model or other overrides. A road with several scenes is left out,
    because the table does not name the scene of a row.

    Parameters
    ----------
    path : file of the table, CSV.
    of : digest of the model, and the overrides, as `made_with` returns them.
    """
    if not path.is_file():
        return {}
    found: dict[tuple[float, str], HeldOut] = {}
    several = set()
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            if (row["model_sha256"], row["overrides"]) != of:
                return {}
            network, classical = (
                {score: float(row[f"{kind}_{score}"]) for score in SIGNS}
                for kind in ("network", "classical")
            )
            one = HeldOut(float(row["lux"]), row["road"], network, classical)
            if (one.lux, one.road) in found:
                several.add(one.road)
            found[one.lux, one.road] = one
    return {key: one for key, one in found.items() if one.road not in several}
