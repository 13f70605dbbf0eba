"""The page of the report: its sections in order, and its style."""

from __future__ import annotations

from html import escape

import numpy as np

from isethdr_core import geometry, view
from isethdr_core.physics import projection

from . import pictures, plots, tables

STYLE = """
:root { color-scheme: light; font: 15px/1.5 system-ui, sans-serif; color: #1b1b1b; background: #fff }
body { max-width: 1240px; margin: 0 auto; padding: 1rem; box-sizing: border-box }
h1 { font-size: 1.6rem; margin: .2rem 0 } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc }
.row { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(360px, 100%), 1fr)); gap: .8rem }
figure { margin: 0 } figcaption { font-size: .85rem; color: #444 } img, svg { max-width: 100%; height: auto; display: block }
figure img, figure svg { width: 100% } .wide { max-width: 860px }
.scroll { overflow-x: auto } table { border-collapse: collapse; font-size: .85rem; width: 100% }
th, td { text-align: left; padding: .2rem .6rem; border-bottom: 1px solid #e4e4e4; vertical-align: top }
th { background: #f4f4f4 } .n { text-align: right; font-variant-numeric: tabular-nums } td small { display: block; color: #666 }
pre { font-size: .78rem; background: #f6f6f6; padding: .8rem; overflow-x: auto }
.scale { margin: .6rem auto; max-width: 640px; text-align: center; font-size: .8rem } .scale img { width: 100%; height: 18px }
.ticks { position: relative; height: 1.4em } .ticks span { position: absolute; transform: translateX(-50%) }
.note { background: #fff6dd; border-left: 4px solid #e0a800; padding: .4rem .8rem } summary { cursor: pointer; font-weight: 600 }
.lead { color: #444 }
"""


def page(result) -> str:
    """Return the whole report of a run as one HTML document that needs no network."""
    a = result.attributes
    seen = {name: (result.open(f"picture/{name}").load(), result.open(f"truth/{name}").load()) for name in result.cameras}
    first_truth = next(iter(seen.values()))[1]
    white = view.white_cd_m2(first_truth)
    sections = [
        ("The scene", _scene(result, white)),
        ("Through the cameras", _cameras(result, seen, white)),
        ("Line through the brightest light, and noise", f"<div class=row>{_profile(seen)}{_snr(seen)}</div>"),
        ("Labels", _labels(seen, white)),
        ("Scores", tables.scores(result, of_objects=False) + "<details><summary>per object</summary>"
         + tables.scores(result, of_objects=True) + "</details>"),
        ("Ledger: error beside seconds", f"<div class=wide>{pictures.figure(plots.seconds(result.ledger), 'Seconds by stage')}</div>"
         + tables.ledger(result.ledger)),
        ("What was left out", tables.left_out(result.ledger)),
        ("Config and versions", "<details open><summary>config</summary>" + tables.config(a["config"]) + "</details>"
         + tables.key_values({**a["versions"], **{f"source of {k}": v for k, v in a["code"].items()}})),
    ]
    body = "".join(f"<section><h2>{title}</h2>{content}</section>" for title, content in sections if content)
    title = f"isethdr run {a['key']}"
    return (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{title}</title><style>{STYLE}</style></head><body><h1>{escape(_title(a))}</h1>{_lead(result)}{body}</body></html>")


def _title(a) -> str:
    return f"{a['config']['scene']['name'].replace('_', ' ')} under {a['lighting']} lighting, {', '.join(a['cameras'])}"


def _lead(result) -> str:
    a, notes = result.attributes, result.attributes["lighting_notes"]
    weights = ", ".join(f"{escape(g)} {w:.4g}" for g, w in a["weights"].items())
    targets = "".join(f" Target {escape(name)}: {t['wanted']:.4g} wanted, {t['reached']:.4g} reached." if isinstance(t, dict) else ""
                      for name, t in (notes.get("targets") or {}).items())
    warning = f"<p class=note>{escape(notes['infeasible'])}</p>" if notes.get("infeasible") else ""
    total = sum(r.seconds for r in result.ledger)
    return (f"<p class=lead>Run {a['key']}, {escape(a['created'])}. {total:.0f} seconds in {len(result.ledger)} stages. "
            f"Light group weights: {weights}.{targets} Lens: {escape(a['lens'])}.</p>{warning}")


def _scene(result, white) -> str:
    """Return the scene as it is, before any camera: each lighting, and the luminance of the one that was used."""
    main = _inside(result.open("versions/main"))
    figures = [pictures.shown(main, white, f"{result.attributes['lighting']}, scene radiance", pictures.compression(main, white))]
    for name in result.attributes["versions_shown"]:
        version = _inside(result.open(f"versions/{name}"))
        its_white = view.white_cd_m2(version)
        figures.append(pictures.shown(version, its_white, f"{name}, scene radiance", pictures.compression(version, its_white)))
    if scale := _range(main):
        figures.append(pictures.false_colour(main, *scale, f"{result.attributes['lighting']}, luminance"))
    return f"<div class=row>{''.join(figures)}</div>"


def _inside(version):
    """Cut the margin away: only what lies in the camera's field is shown."""
    half_x, half_y = version.attrs["field_width"] / 2, version.attrs["field_height"] / 2
    return version.sel(x=slice(-half_x, half_x), y=slice(-half_y, half_y)).load()


def _cameras(result, seen, white) -> str:
    """Return each camera's picture with the truth's white, its luminance below, and the scale of both rows of false colour."""
    main = _inside(result.open("versions/main"))
    scale, compressed = _range(main), pictures.compression(main, white)
    rows = [pictures.shown(picture, white, name, compressed) for name, (picture, _) in seen.items()]
    if scale:
        rows += [pictures.false_colour(picture, *scale, f"{name}, luminance") for name, (picture, _) in seen.items()]
    return f"<div class=row>{''.join(rows)}</div>" + (pictures.colour_scale(*scale) if scale else "")


def _range(scene) -> tuple[float, float] | None:
    """Return the luminances between which false colour runs, cd/m2; None for a scene of one luminance."""
    y = view.luminance(scene)
    low, high = max(float(np.percentile(y, 1)), y.max() * 1e-9), float(y.max())
    return (low, high) if 0 < low < high else None


def _profile(seen) -> str:
    profiles, floor = {}, np.inf
    for name, (picture, truth) in seen.items():
        y = view.luminance(truth)
        row = int(np.unravel_index(np.argmax(y), y.shape)[0])
        angle = _angles_deg(picture, row)
        profiles[name] = (angle, view.luminance(picture)[row])
        profiles["truth"] = (angle, y[row])
        floor = min(floor, max(float(y[row].min()) / 10, 1e-12))
    return pictures.figure(plots.line_profile(profiles, floor), "Luminance along the row through the brightest light of the truth; "
                   "estimates at or below zero are drawn at the lower edge")


def _angles_deg(picture, row: int) -> np.ndarray:
    """Return the horizontal field angle, right positive, at which each pixel of a row looks through the lens, distortion and projection included."""
    f_m = picture.attrs["focal_length_mm"] * 1e-3
    field = geometry.map_of(picture).inverse(picture.x.values / f_m, picture.y.values[row] / f_m)
    right, _, forward = projection.direction(*field, geometry.projection_of(picture))
    return np.degrees(np.arctan2(right, forward))


def _snr(seen) -> str:
    curves = {name: plots.snr_curve(picture, truth) for name, (picture, truth) in seen.items()}
    return pictures.figure(plots.snr_against_luminance({k: v for k, v in curves.items() if len(v[0])}),
                   "Signal-to-noise ratio of the median pixel of each true luminance, from the variance that each picture carries")


def _labels(seen, white) -> str:
    truth = next(iter(seen.values()))[1]
    if "instance" not in truth:
        return ""
    objects = truth.attrs.get("objects") or []
    return f"<div class=wide>{pictures.labelled(truth, white, truth, objects)}</div>"
