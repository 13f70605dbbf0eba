"""The page of the report: the content of each section, filled into the template."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.cli.summary_tables import remarks, target_texts
from isethdr_core.data import camera_geometry
from isethdr_core.display import display_view
from isethdr_core.physics.optics import projection
from isethdr_core.runs.run_warnings import sentence

from ..record import assets
from . import pictures, plots, tables
from .pictures import Figure
from .templates import filled, script
from .viewer import Look, finest_look, looks, viewer

if TYPE_CHECKING:
    import xarray as xr
    from markupsafe import Markup

    from isethdr_core.runs.run import Result

LINE_NOTE = (
    "Luminance along the row through the brightest light of the reference picture, which has no "
    "flare and no noise; estimates at or below zero are drawn at the lower edge"
)
SNR_NOTE = (
    "Signal-to-noise ratio of the median pixel at each luminance of the reference picture, "
    "from the variance that each picture states, before any denoising"
)


def page(result: Result) -> Markup:
    """Return the whole report of a run as one HTML document that needs no network."""
    from omegaconf import OmegaConf

    a = result.attributes
    cameras = looks(result)
    reference = finest_look(cameras).truth
    white = pictures.shown_white_cd_m2(reference, [look.picture for look in cameras])
    compressed = pictures.compression(reference, white)
    scale = _range(reference)
    views = _views(cameras, reference, white, compressed)
    curves = {look.name: plots.snr_curve(look.picture, look.truth) for look in cameras}
    curves = {name: curve for name, curve in curves.items() if len(curve[0])}
    sources = {f"source of {name}": digest for name, digest in a["code"].items()}
    return filled(
        "page.html",
        key=a["key"],
        title=_title(a),
        created=a["created"],
        seconds=sum(row.seconds for row in result.ledger),
        stages=len(result.ledger),
        weights=list(a["weights"].items()),
        targets=target_texts(a["lighting_notes"].get("targets") or {}),
        lens=a["lens"],
        notes=[*_notes(a["lighting_notes"]), *map(sentence, a.get("warnings", []))],
        viewer=viewer(cameras, views, scale),
        script=script("viewer.js"),
        views=views,
        scale=pictures.colour_scale(*scale) if scale else None,
        cameras=tables.cameras(cameras),
        line=Figure("", LINE_NOTE, drawing=_profile(cameras)),
        # no picture states its variance where a network developed all of them
        noise=[Figure("", SNR_NOTE, drawing=plots.snr_against_luminance(curves))] if curves else [],
        labels=_labels(reference, white, compressed),
        scene=_scene(result),
        remarks=remarks(result),
        frame_scores=tables.scores(result, of_objects=False),
        object_scores=tables.scores(result, of_objects=True),
        seconds_plot=Figure("", "Seconds by stage", drawing=plots.seconds(result.ledger)),
        ledger=tables.ledger(result.ledger),
        left_out=tables.left_out(result.ledger),
        config=OmegaConf.to_yaml(OmegaConf.create(a["config"])),
        versions=tables.key_values({**a["versions"], **sources}),
    )


def _title(a: dict) -> str:
    scene = a["config"]["scene"]["name"].replace("_", " ")
    title = f"{scene} under {a['lighting']} lighting: {', '.join(a['cameras'])}"
    return title[:1].upper() + title[1:]


def _notes(notes: dict) -> list[str]:
    """Return the notes at the top of the page."""
    return [notes["infeasible"]] if notes.get("infeasible") else []


def _scene(result: Result) -> list[Figure]:
    """Return scene radiance without a camera: in the run's lighting, then in others. A run with
    `report=false` stores none.
    """
    stored = assets(result.path)
    title_names = {result.attributes["lighting"]: "main"}
    title_names |= {name: name for name in result.attributes["versions_shown"]}
    figures = []
    for title, name in title_names.items():
        if f"versions/{name}" not in stored:
            continue
        version = _inside(result.open(f"versions/{name}"))
        white = pictures.shown_white_cd_m2(version)
        compressed = pictures.compression(version, white)
        figures.append(pictures.shown(version, white, f"{title}, scene radiance", compressed))
    return figures


def _inside(version: xr.Dataset) -> xr.Dataset:
    """Return a version cropped to the camera's field, without overscan."""
    half_x = version.attrs["field_width"] / 2
    half_y = version.attrs["field_height"] / 2
    return version.sel(x=slice(-half_x, half_x), y=slice(-half_y, half_y)).load()


def _views(
    cameras: list[Look], reference: xr.Dataset, white: float, compressed: float
) -> list[Figure]:
    """Return the views of the reference and of each camera's picture, lossless, with one white and
    one tone curve.
    """
    named = [("Reference", reference), *((look.name, look.picture) for look in cameras)]
    return [pictures.shown(view, white, name, compressed) for name, view in named]


def _range(scene: xr.Dataset) -> tuple[float, float] | None:
    """Return the range of luminance of the false colours, cd/m2.

    It is None for a scene of uniform luminance.
    """
    y = display_view.luminance(scene)
    low = max(float(np.percentile(y, 1)), y.max() * 1e-9)
    high = float(y.max())
    return (low, high) if 0 < low < high else None


def _profile(cameras: list[Look]) -> Markup:
    profiles = {}
    floor = np.inf
    for look in cameras:
        y = display_view.luminance(look.truth)
        row = int(np.unravel_index(np.argmax(y), y.shape)[0])
        angle = _angles_deg(look.picture, row)
        profiles[look.name] = (angle, display_view.luminance(look.picture)[row])
        profiles["truth"] = (angle, y[row])
        floor = min(floor, max(float(y[row].min()) / 10, 1e-12))
    return plots.line_profile(profiles, floor)


def _angles_deg(picture: xr.Dataset, row: int) -> np.ndarray:
    """Return the horizontal field angle of each pixel of a row, degrees, right positive.

    It includes the lens distortion and the projection.
    """
    f_m = picture.attrs["focal_length_mm"] * 1e-3
    field = camera_geometry.map_of(picture).inverse(
        picture.x.values / f_m, picture.y.values[row] / f_m
    )
    right, _, forward = projection.direction(*field, camera_geometry.projection_of(picture))
    return np.degrees(np.arctan2(right, forward))


def _labels(truth: xr.Dataset, white: float, compressed: float) -> Figure | None:
    if "instance" not in truth:
        return None
    return pictures.labelled(truth, white, compressed, truth, truth.attrs.get("objects") or [])
