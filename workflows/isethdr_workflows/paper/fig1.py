"""Overview: the light groups of one rendering, its mixes by night and by day, its labels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.config.composition import compose
from isethdr_core.data.quantities import tristimulus
from isethdr_core.display.display_view import display, false_colour, white_cd_m2
from isethdr_core.pipeline.chain import chain
from isethdr_core.storage.store import open_scene

from ..dataset.pairs.request import PairRequest
from ..dataset.pairs.sources import sources
from .rendered_scene import rendered, thinned, write_sheet

if TYPE_CHECKING:
    import xarray as xr

DECADES = 6  # range of the false colours of a light group, down from its brightest tile
LONGEST_M = 150.0  # longest distance in the picture of distances
GOLDEN = 0.618033988749895  # step of the hue, which gives consecutive objects different colours


def paper_fig1(
    picture: str = "", scene: str = "night_drive", store: str = ""
) -> list[dict[str, Any]]:
    """Repeat figure 1 of the ISETHDR paper: light groups of a scene, and their sums.

    Parameters
    ----------
    picture : file for light groups, night, day, objects and distances (png or jpg); empty writes
        none.
    scene : experiment that gives the lightings, and the rendering if `store` is empty.
    store : stored radiance to use: a stored scene by its name or the beginning of its name, or a
        dataset, of which the first scene is used; empty: that of `scene`.

    Returns
    -------
    rows with group, median_cd_m2 and brightest_cd_m2 at weight 1, night_share and day_share (share
    of the light of all groups by night and by day).
    """
    night, radiance = rendered(f"experiment={scene}") if not store else (None, stored(store))
    lightings = {
        "night": night.lighting if night else chain(compose([f"experiment={scene}"])).lighting,
        "day": chain(
            compose([f"experiment={scene}", "lighting=day", "lighting.others=1.0"])
        ).lighting,
    }
    mixed = {name: lighting(radiance) for name, lighting in lightings.items()}
    groups = {
        str(group): luminance_of(radiance.radiance.sel(light_group=group))
        for group in radiance.light_group.values
    }
    inside = in_field(radiance)
    rows = []
    for group, luminance in groups.items():
        seen = luminance[inside]
        row = {
            "group": group,
            "median_cd_m2": float(np.median(seen)),
            "brightest_cd_m2": float(seen.max()),
        }
        for name, light in mixed.items():
            weights = light.attrs["weights"]
            whole = sum(weights.get(g, 0.0) * y[inside].sum() for g, y in groups.items())
            row[f"{name}_share"] = float(weights.get(group, 0.0) * seen.sum() / whole)
        rows.append(row)
    if picture:
        write(picture, radiance, groups, mixed)
    return rows


def stored(name: str) -> xr.Dataset:
    """Return the radiance of a stored scene, or of the first scene of a dataset."""
    [first] = sources(PairRequest(name, scenes=1))
    return open_scene(first.store)


def luminance_of(light: xr.DataArray) -> np.ndarray:
    """Return luminance (y, x), cd/m2, of radiance (wavelength, y, x)."""
    return tristimulus(light)["xyz"].values[..., 1]


def in_field(radiance: xr.Dataset) -> tuple[slice, slice]:
    """Return the (rows, columns) of the tiles within the camera's field, without overscan."""
    found = []
    for dim, size in (("y", "field_height"), ("x", "field_width")):
        inside = np.flatnonzero(np.abs(radiance[dim].values) <= radiance.attrs[size] / 2)
        found.append(slice(int(inside[0]), int(inside[-1]) + 1))
    return found[0], found[1]


def write(path: str, radiance: xr.Dataset, groups: dict, mixed: dict) -> None:
    """Write the light groups in false colours, and below them night, day, objects and distances.

    Parameters
    ----------
    path : file of the figure.
    radiance : scene radiance with its labels.
    groups : {light group: (y, x) luminance, cd/m2}.
    mixed : {title: mixed radiance}, night and day.
    """
    inside = in_field(radiance)
    top = []
    names = []
    for group, luminance in groups.items():
        seen = luminance[inside]
        high = max(float(seen.max()), 1e-12)
        top.append(thinned(false_colour(seen, high * 10.0**-DECADES, high)[0]))
        names.append(f"{group}: {high * 10.0**-DECADES:.1g} to {high:.1g} cd/m2")
    below = []
    for light in mixed.values():
        xyz = tristimulus(light)["xyz"].values[inside]
        white = white_cd_m2(xyz)
        below.append(thinned(display(xyz, white)))
    below_names = list(mixed)
    if "instance" in radiance:
        below.append(thinned(coloured(radiance["instance"].values[inside])))
        below_names.append("objects")
    if "distance" in radiance:
        near = np.minimum(radiance["distance"].values[inside], LONGEST_M)
        below.append(thinned(false_colour(near, 1.0, LONGEST_M)[0]))
        below_names.append(f"distance: 1 to {LONGEST_M:g} m")
    write_sheet(path, [top, below], [names, below_names])


def coloured(instance: np.ndarray) -> np.ndarray:
    """Return numbers of objects (y, x) as colours, uint8 (y, x, 3); 0 is black."""
    hue = (instance.astype(float) * GOLDEN)[..., None] % 1.0 + np.array([0.0, 1 / 3, 2 / 3])
    colours = 255 * (0.55 + 0.45 * np.cos(2 * np.pi * hue))
    return np.where(instance[..., None] == 0, 0, colours).astype(np.uint8)
