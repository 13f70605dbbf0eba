"""Exposure ladder of a phone camera at night: with longer exposures, road users become visible, but
the flare of headlights grows and hides them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.plugins.registry import build

from .parameters import PAPER, SCRIPTS, chosen
from .rendered_scene import rendered, seen_by, shown, thinned, through, write_sheet

if TYPE_CHECKING:
    import xarray as xr

# white of a picture times its exposure; the white does not depend on the content of the picture
WHITE_CD_S_M2 = 0.3
PHONE = {"f_number": 1.73, "focal_length_mm": 4.38}  # Google Pixel 4a


class Ladder(NamedTuple):
    """A sensor and its exposures."""

    sensor: str
    exposures_s: tuple[float, ...]


# the text states a Pixel 4a and 5 to 40 ms; the scripts use an AR0132AT and other exposures
LADDERS = {
    PAPER: Ladder("bayer_imx363", (0.005, 0.010, 0.020, 0.040)),
    SCRIPTS: Ladder("bayer_isethdr", (0.005, 0.0405, 0.3242)),
}
OBJECTS = ("cyclist", "pedestrian", "person", "bicycle")  # words in the names of people


def paper_fig5(
    picture: str = "", scene: str = "night_drive", parameters: str = PAPER
) -> list[dict]:
    """Repeat figure 5 of the ISETHDR paper: a phone camera at night, exposures from 5 to 40 ms.

    Parameters
    ----------
    picture : file for the ladder (png or jpg); empty writes none.
    scene : experiment that gives the rendering; its stored radiance is reused.
    parameters : paper (Pixel 4a, 5 to 40 ms), or scripts (AR0132AT of 3 um, 5, 40.5 and 324.2 ms).

    Returns
    -------
    rows with exposure_s, saturated_percent (of the pixels), snr_person (median ratio of signal to
    noise over pixels of people and cyclists), detection (median contrast detection probability of
    these objects).
    """
    ladder = chosen("paper_fig5", parameters, LADDERS)
    scene_chain, radiance = rendered(f"experiment={scene}", f"sensor={ladder.sensor}")
    mixed, light = through(scene_chain, radiance, scene_chain.lighting, **PHONE)
    (sensor,) = scene_chain.cameras.values()
    isp = build("isp", "linear", balance="automatic")
    detection = build("metric", "contrast_detection")
    rows = []
    views = []
    for exposure_s in ladder.exposures_s:
        shot, seen_picture, true, labels = seen_by(
            replace(sensor, exposure_s=exposure_s), isp, mixed, light, radiance
        )
        rows.append(
            {
                "exposure_s": exposure_s,
                "saturated_percent": 100 * float(shot["saturated"].mean()),
                **people(seen_picture, true, labels, detection),
            }
        )
        views.append(thinned(shown(seen_picture, WHITE_CD_S_M2 / exposure_s)))
    if picture:
        names = [
            f"{1e3 * row['exposure_s']:g} ms, {row['saturated_percent']:.2f} % saturated"
            for row in rows
        ]
        write_sheet(picture, [views[:2], views[2:]], [names[:2], names[2:]])
    return rows


def people(picture: xr.Dataset, true: xr.Dataset, labels: xr.Dataset, detection: Any) -> dict:
    """Return signal to noise and contrast detection of the people in a picture; NaN if there are
    none.

    Parameters
    ----------
    picture : picture of the camera, (y, x, xyz_channel).
    true : reference picture on the same grid.
    labels : labels on the same grid.
    detection : the metric `contrast_detection`.
    """
    scores = [
        s
        for s in detection(picture, true, labels)
        if s.object and any(word in s.object for word in OBJECTS)
    ]
    names = {s.object for s in scores}
    mask = np.isin(
        labels["instance"].values,
        [o["instance"] for o in labels.attrs.get("objects", []) if o["name"] in names],
    )
    y = picture["xyz"].values[..., 1][mask]
    var = picture["variance"].values[..., 1][mask]
    any_person = y.size > 0
    return {
        "snr_person": float(np.median(y / np.sqrt(var))) if any_person else np.nan,
        "detection": float(np.median([s.value for s in scores])) if scores else np.nan,
    }
