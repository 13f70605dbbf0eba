"""Stored scores: the scores of a metric for the pictures of a stored run, without running the
chain.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from isethdr_core.data.score_checks import check_scores
from isethdr_core.errors import CatalogError
from isethdr_core.plugins.protocols import Metric
from isethdr_core.store import open_store, read_attrs

PICTURE = ("xyz", "variance", "valid")  # variables of a reference picture; others are labels


def scores_of(path: Path | str, metric: Metric) -> list[dict[str, Any]]:
    """Return the scores of a metric for the stored picture of each camera of a run.

    Parameters
    ----------
    path : path of the run's store.
    metric : any metric, also one that the run did not compute.

    Returns
    -------
    list : one dictionary per camera, metric and object: camera, metric, value, unit, object, low,
        high. The picture is that of the first noise realisation, so `low` and `high` are the spread
        that the metric estimates from one picture. They do not include renderer noise.

    Raises
    ------
    CatalogError : the store is no run, is damaged, or lacks a picture or its reference.
    PluginError : the metric returned something else than scores.

    Notes
    -----
    Pictures are stored with the rounding that their attribute `rounding` states. A metric that
    needs labels gets those that the run stored.
    """
    attributes = read_attrs(path)
    if attributes.get("kind") != "run":
        raise CatalogError(
            f"{path} holds a {attributes.get('kind', 'store of another kind')}; expected a run; "
            "`isethdr catalog find kind=run` lists them"
        )
    rows = []
    for camera in attributes["cameras"]:
        picture = open_store(path, f"picture/{camera}").load()
        reference = open_store(path, f"truth/{camera}").load()
        labels = reference.drop_vars([name for name in PICTURE if name in reference])
        if "direction" in labels.dims:  # the run renamed `xyz`, which is a variable of pictures
            labels = labels.rename_dims(direction="xyz")
        scores = check_scores(type(metric).__name__, metric(picture, reference, labels))
        rows += [{"camera": camera, **asdict(score)} for score in scores]
    return rows
