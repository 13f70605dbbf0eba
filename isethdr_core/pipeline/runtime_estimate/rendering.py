"""Rendering: the work of a rendering relative to that of a stored scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ...plugins.protocols import EstimatesRendering, EstimatesSamples, MeetsNoiseLimit
from .work import SIDES, band_count, is_positive, tile_count

if TYPE_CHECKING:
    from ...plugins.protocols import Renderer
    from ..chain import Chain
    from ..demand import Demand
    from ..memory import Frame


def rendering_s(chain: Chain, frame: Frame, missing: Demand) -> float | None:
    """Return the seconds that the renderer expects for a frame; None if it has no estimate.

    Parameters
    ----------
    chain : components of the run.
    frame : tiles and bands to render.
    missing : the demand for what has to be rendered.
    """
    if not isinstance(chain.renderer, EstimatesRendering):
        return None
    return chain.renderer.rendering_s(frame, missing.groups and len(missing.groups))


def estimated_ratio(
    chain: Chain,
    settings: Mapping[str, Any],
    missing: Demand,
    frame: Frame | None,
    attributes: Mapping[str, Any],
) -> float | None:
    """Return the work of rendering a frame relative to that of a stored scene, by the renderer's
    own estimate, which includes work that does not grow with the tiles.

    None where the renderer has no estimate, or where the stored scene is not one whole rendering of
    the same kind.

    Parameters
    ----------
    chain : components of the run.
    settings : settings of its renderer, as plain data.
    missing : the demand for what has to be rendered.
    frame : tiles and bands to render; None if they are not known.
    attributes : root attributes of the stored scene.
    """
    renderer = chain.renderer
    sides = [source.get(k) for source in (settings, attributes["renderer"]) for k in SIDES]
    if (
        frame is None
        or not isinstance(renderer, MeetsNoiseLimit)
        or not all(map(is_positive, sides))
    ):
        return None
    share = renderer.limit_share()
    if share is None or attributes.get("limit_share") != share:
        return None
    all_groups = attributes["all_groups"]
    partly = len(missing.groups or all_groups) < len(all_groups)
    continued = any(first for first, _ in attributes.get("path_span", {}).values())
    if partly or continued or attributes.get("groups_from"):
        return None
    height, width, stored_height, stored_width = sides
    before = replace(
        frame,
        rows=round(frame.rows * stored_height / height),
        columns=round(frame.columns * stored_width / width),
    )
    to_come, stored = (rendering_s(chain, f, missing) for f in (frame, before))
    return to_come / stored if to_come and stored else None


def ratio_by_samples(
    renderer: Renderer | None, settings: dict, missing: Demand, attributes: dict[str, float | str]
) -> float | None:
    """Return the work of rendering the `missing` radiance, relative to that of a stored scene:
    tiles x bands x samples of all light groups. None where no group of the stored scene was
    rendered for it.

    Parameters
    ----------
    renderer : renderer of the run.
    settings : its settings, as plain data.
    missing : the demand for what has to be rendered.
    attributes : root attributes of the stored scene.
    """
    bands = (len(missing.wavelength_nm or ()) or band_count(settings)) / len(
        attributes["wavelength_nm"]
    )
    groups = missing.groups or attributes["all_groups"]
    stored_paths = {
        group: end - first for group, (first, end) in attributes.get("path_span", {}).items()
    } or dict.fromkeys(attributes["groups"], 1)
    finer = _finer(renderer, attributes.get("limit_share"))
    expected_paths = {
        group: _expected_paths(renderer, paths * finer, attributes.get("noise", {}).get(group))
        for group, paths in stored_paths.items()
    }
    taken_over = attributes.get("groups_from", {})  # groups that another rendering took time for
    own_paths = sum(paths for group, paths in stored_paths.items() if group not in taken_over)
    if own_paths == 0:
        return None
    typical = sum(expected_paths.values()) / len(expected_paths)  # for groups that the store lacks
    return (
        sum(expected_paths.get(g, typical) for g in groups)
        / own_paths
        * bands
        * tile_count(settings)
        / tile_count(attributes["renderer"])
    )


def _finer(renderer: Renderer | None, stored_share: float | None) -> float:
    """Return the ratio of the samples that the renderer's share of the cameras' noise needs, to
    those that `stored_share` needed; 1 if either rendering stops by another criterion.
    """
    share = renderer.limit_share() if isinstance(renderer, MeetsNoiseLimit) else None
    return (stored_share / share) ** 2 if stored_share and share else 1.0


def _expected_paths(renderer: Renderer | None, paths: float, noise: float | None) -> float:
    """Return the number of samples per tile that a light group is expected to take.

    A renderer without an estimate is expected to take as many as its stored rendering.
    """
    if isinstance(renderer, EstimatesSamples):
        return renderer.expected_paths(paths, noise)
    return paths
