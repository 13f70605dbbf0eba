"""Render request: what a renderer is asked for, and what is taken over from other frames instead.

In a sequence, light groups with the same light as in a stored frame are not rendered again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ...sequence.equal_content import contents_of
from ...sequence.equal_groups import (
    LimitBeside,
    Taken,
    TooNoisy,
    Wanted,
    find_groups,
    groups_of,
    taken_over,
)
from ...sequence.equal_groups import opened as opened_groups
from ...sequence.equal_radiance import ContentNames, content_names
from ...sequence.frame_seed import has_frame_seed, with_frame_seed
from ...storage.encoding import bits_for
from ...uncertainty.budget import stored_error
from ...uncertainty.ledger import left_out
from .recipe import effort, scenes_folder
from .rendered_radiance import checked
from .stored_radiance import held, limit_share

if TYPE_CHECKING:
    import xarray as xr

    from ...data.scene_description import SceneDescription
    from ...pipeline.chain import Chain
    from ...pipeline.demand import Demand
    from ..sample_accumulation import Known


class Rendering(NamedTuple):
    """A renderer, and the names of the content that it renders."""

    renderer: Any  # renderer of the run; in a sequence with the seed of the frame
    content: ContentNames | None  # None if a plugin's part of the description is no plain data


def rendering_of(chain: Chain, description: SceneDescription, recipe: str) -> Rendering:
    """Return the renderer of a description, and the names by which equal light is recognised.

    Parameters
    ----------
    chain : components of the run.
    description : description of the scene.
    recipe : name of the radiance, by `recipe_hash`.
    """
    contents = contents_of(description)
    renderer = chain.renderer
    if has_frame_seed(renderer, chain.exposures):
        renderer = with_frame_seed(renderer, contents.surfaces if contents else recipe)
    content = contents and content_names(contents, renderer, effort(chain))
    return Rendering(renderer, content)


@dataclass(frozen=True)
class Request:
    """What a renderer is asked for."""

    description: SceneDescription
    demand: Demand  # groups and bands that are missing
    renderer: Any  # renderer with the seed of the frame
    # stored samples by light group; None: the renderer cannot continue from stored samples
    known: dict[str, Known] | None
    by_noise: bool = False  # store only bits that are significant above a tile's noise
    content: ContentNames | None = None  # names by which frames with equal light are recognised
    # light groups of other frames, which are not rendered
    taken: list[Taken] = field(default_factory=list)

    def groups_asked(self) -> tuple[str, ...]:
        """Return the light groups that are asked for."""
        groups = self.demand.groups
        return self.description.light_groups() if groups is None else groups

    def of_rest(self, share: float | None) -> Request:
        """Return the request for the groups that are not taken over.

        Parameters
        ----------
        share : noise at which the renderer stops, over that of the cameras; None: another setting
            decides.
        """
        taken = groups_of(self.taken)
        asked = self.demand.groups or self.description.light_groups()
        rest = tuple(group for group in asked if group not in taken)
        demand = replace(self.demand, groups=rest)
        if share is not None and demand.noise_limit is not None:
            others = opened_groups(scenes_folder(), self.taken)
            demand = replace(demand, noise_limit=LimitBeside(demand.noise_limit, others, share))
        known_rest = self.known and {group: self.known[group] for group in rest}
        return replace(self, demand=demand, known=known_rest)

    def render(self) -> xr.Dataset:
        """Return what the renderer makes of the request."""
        if self.known is None:
            return self.renderer(self.description, self.demand)
        return self.renderer(self.description, self.demand, self.known)


def equal_groups(chain: Chain, request: Request) -> list[Taken]:
    """Return the light groups of a request that stores of other frames hold with the same light.

    Outside sequences there are none: the number of samples that the renderer takes for the other
    groups would depend on what is stored.
    """
    demand = request.demand
    content = request.content
    if content is None or chain.exposures is None:
        return []
    asked = demand.groups or request.description.light_groups()
    contents = {g: name for g, name in content.groups.items() if g in asked}

    def precise(attributes: dict[str, Any], group: str) -> bool:
        alone = replace(demand, groups=(group,), labels=frozenset())
        return held(chain, alone, [attributes]).missing is None

    wanted = Wanted(contents, demand, bits_for(stored_error(demand)))
    return find_groups(scenes_folder(), wanted, precise)


def rendered(chain: Chain, request: Request, title: str) -> xr.Dataset:
    """Return the radiance of a request: rendered, or taken over from other frames.

    Parameters
    ----------
    chain : components of the run.
    request : what the renderer is asked for.
    title : the renderer in messages, for example "renderer 'mitsuba'".

    Raises
    ------
    PluginError, UnitError : the renderer returned something else than radiance; see `checked`.
    """
    if not request.taken:
        return checked(request.render(), title)
    try:
        scene = checked(request.of_rest(limit_share(chain, request.demand)).render(), title)
    except TooNoisy:
        left_out(
            f"light groups {', '.join(groups_of(request.taken))} of other frames",
            "not reused: they are too noisy for the light of this frame",
            0.0,
            "relative",
            key="equal groups",
        )
        return checked(request.render(), title)
    return taken_over(scenes_folder(), scene, request.taken, request.description.light_groups())
