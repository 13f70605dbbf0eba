"""The page of the report: what each section shows, put into the template."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.cli.summary_tables import remarks
from isethdr_core.data import camera_geometry
from isethdr_core.display import display_view
from isethdr_core.physics.optics import projection
from isethdr_core.runs.run_warnings import sentence

from . import pictures, plots, tables
from .pictures import Figure
from .templates import filled

if TYPE_CHECKING:
    from markupsafe import Markup

    from isethdr_core.runs.run import Result

LINE_NOTE = (
    "Luminance along the row through the brightest light of the truth; "
    "estimates at or below zero are drawn at the lower edge"
)
SNR_NOTE = (
    "Signal-to-noise ratio of the median pixel of each true luminance, "
    "from the variance that each picture carries"
)


def page(result: Result) -> Markup:
    """Return the whole report of a run as one HTML document that needs no network."""
    from omegaconf import OmegaConf

    a = result.attributes
    seen = {
        name: (result.open(f"picture/{name}").load(), result.open(f"truth/{name}").load())
        for name in result.cameras
    }
    truth = next(iter(seen.values()))[1]
    white = display_view.white_cd_m2(truth)
    main = _inside(result.open("versions/main"))
    scale = _range(main)
    curves = {name: plots.snr_curve(*both) for name, both in seen.items()}
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
        targets=_targets(a["lighting_notes"]),
        lens=a["lens"],
        notes=[*_notes(a["lighting_notes"]), *map(sentence, a.get("warnings", []))],
        scene=_scene(result, main, white, scale),
        cameras=_cameras(seen, main, white, scale),
        scale=pictures.colour_scale(*scale) if scale else None,
        plots=[
            Figure("", LINE_NOTE, drawing=_profile(seen)),
            Figure("", SNR_NOTE, drawing=plots.snr_against_luminance(curves)),
        ],
        labels=_labels(truth, white),
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
    return f"{scene} under {a['lighting']} lighting, {', '.join(a['cameras'])}"


def _targets(notes: dict) -> list[tuple[str, dict]]:
    """Return the photometric targets by name: what was wanted and what was reached."""
    return [(name, t) for name, t in (notes.get("targets") or {}).items() if isinstance(t, dict)]


def _notes(notes: dict) -> list[str]:
    """Return what a reader must know before anything else."""
    return [notes["infeasible"]] if notes.get("infeasible") else []


def _scene(result: Result, main, white: float, scale: tuple[float, float] | None) -> list[Figure]:
    """Return the scene before any camera: each lighting, and the luminance of the one in use."""
    lighting = result.attributes["lighting"]
    compressed = pictures.compression(main, white)
    figures = [pictures.shown(main, white, f"{lighting}, scene radiance", compressed)]
    for name in result.attributes["versions_shown"]:
        version = _inside(result.open(f"versions/{name}"))
        its_white = display_view.white_cd_m2(version)
        compressed = pictures.compression(version, its_white)
        figures.append(pictures.shown(version, its_white, f"{name}, scene radiance", compressed))
    if scale:
        figures.append(pictures.false_colour(main, *scale, f"{lighting}, luminance"))
    return figures


def _inside(version):
    """Cut the margin away: only what lies in the camera's field is shown."""
    half_x, half_y = version.attrs["field_width"] / 2, version.attrs["field_height"] / 2
    return version.sel(x=slice(-half_x, half_x), y=slice(-half_y, half_y)).load()


def _cameras(seen, main, white: float, scale: tuple[float, float] | None) -> list[Figure]:
    """Return each camera's picture with the truth's white, then the luminance of each."""
    compressed = pictures.compression(main, white)
    figures = [
        pictures.shown(picture, white, name, compressed) for name, (picture, _) in seen.items()
    ]
    if scale:
        for name, (picture, _) in seen.items():
            figures.append(pictures.false_colour(picture, *scale, f"{name}, luminance"))
    return figures


def _range(scene) -> tuple[float, float] | None:
    """Return the luminances between which false colour runs, cd/m2; None for a scene of one
    luminance.
    """
    y = display_view.luminance(scene)
    low, high = max(float(np.percentile(y, 1)), y.max() * 1e-9), float(y.max())
    return (low, high) if 0 < low < high else None


def _profile(seen) -> Markup:
    profiles, floor = {}, np.inf
    for name, (picture, truth) in seen.items():
        y = display_view.luminance(truth)
        row = int(np.unravel_index(np.argmax(y), y.shape)[0])
        angle = _angles_deg(picture, row)
        profiles[name] = (angle, display_view.luminance(picture)[row])
        profiles["truth"] = (angle, y[row])
        floor = min(floor, max(float(y[row].min()) / 10, 1e-12))
    return plots.line_profile(profiles, floor)


def _angles_deg(picture, row: int) -> np.ndarray:
    """Return the horizontal field angle, right positive, at which each pixel of a row looks through
    the lens, distortion and projection included.
    """
    f_m = picture.attrs["focal_length_mm"] * 1e-3
    field = camera_geometry.map_of(picture).inverse(
        picture.x.values / f_m, picture.y.values[row] / f_m
    )
    right, _, forward = projection.direction(*field, camera_geometry.projection_of(picture))
    return np.degrees(np.arctan2(right, forward))


def _labels(truth, white: float) -> Figure | None:
    if "instance" not in truth:
        return None
    return pictures.labelled(truth, white, truth, truth.attrs.get("objects") or [])
