"""Memory estimate: the peak memory of a run, before it starts.

The estimate is the sum of what the program, the light, the lens, the renderer and the pixels of all
cameras take, as components state it (`memory`). To this is added the memory that the most similar
stored run took beyond the sum that its components stated.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..plugins.protocols import CountsRenderMemory
from . import memory
from .runtime_estimate import OTHER_SETTINGS, newest, pixel_bytes

if TYPE_CHECKING:
    from .chain import Chain
    from .demand import Demand

PROGRAM = "program"
PROGRAM_BYTES = 1.1e8  # Python and the libraries of a run; ledgers show 100 to 145 MB for its plan
STATED = "stated_bytes"  # attribute of a run: the sum of what its components state


class Expected(NamedTuple):
    """The peak memory that is expected of a run."""

    parts: dict[str, float]  # {what: bytes}, as stated
    more_bytes: float  # peak of a similar stored run minus the sum that it stated; 0 without one

    @property
    def total_bytes(self) -> float:
        """The expected peak."""
        return max(sum(self.parts.values()) + self.more_bytes, PROGRAM_BYTES)


def stated_parts(
    chain: Chain, frame: memory.Frame | None, rendered: bool
) -> dict[str, float] | None:
    """Return {what: bytes} of a run, as its components state it; None where its frame is not known.

    Parameters
    ----------
    chain : components of the run.
    frame : tiles and bands of the light; None if they are not known.
    rendered : whether the run renders radiance instead of reading stored radiance.
    """
    if frame is None:
        return None
    # a rendered scene may have lamps, whose light a lens spreads over the whole frame
    seen = frame if chain.renderer is None else replace(frame, sensed=False)
    flares = tuple(chain.flares.values())
    parts = {PROGRAM: PROGRAM_BYTES, "light": memory.cube_bytes(frame)}
    parts |= memory.held_bytes(chain.lens, flares, seen)
    if rendered and isinstance(chain.renderer, CountsRenderMemory):
        parts["renderer"] = chain.renderer.memory_bytes(frame)
    # captures and pictures of all cameras are held until they are stored together
    return parts | {f"pixels of {name}": size for name, size in pixel_bytes(chain).items()}


def expected_memory(
    chain: Chain, config: dict, missing: Demand | None, frame: memory.Frame | None
) -> Expected | None:
    """Return the peak memory that is expected of a run; None where its frame is not known.

    Parameters
    ----------
    chain : components of the run.
    config : plain data from which the chain was built.
    missing : demand for radiance that has to be rendered; None if all is stored.
    frame : tiles and bands of the light; None if they are not known.
    """
    parts = stated_parts(chain, frame, missing is not None)
    if parts is None:
        return None
    nearest = math.inf
    more = 0.0
    for run in newest("runs"):
        rows = [row for row in run["ledger"] if not row.get("reused")]
        stated = run.get(STATED)
        if not stated or not rows or _renders(run["config"], rows) != _kind(config, missing):
            continue
        distance = abs(math.log(sum(parts.values()) / stated))
        distance += 0.0 if _spread(config) == _spread(run["config"]) else math.log(OTHER_SETTINGS)
        if distance < nearest:
            nearest = distance
            more = max(row["peak_bytes"] for row in rows) - stated
    return Expected(parts, more)


def _kind(config: dict, missing: Demand | None) -> tuple[str, bool]:
    """Return the renderer of a run to come, and whether it renders."""
    return (config.get("renderer") or {}).get("name", ""), missing is not None


def _renders(config: dict, rows: list[dict[str, Any]]) -> tuple[str, bool]:
    """Return the renderer of a stored run, and whether it rendered."""
    rendered = any(row["stage"].startswith("renderer ") for row in rows)
    return (config.get("renderer") or {}).get("name", ""), rendered


def _spread(config: dict) -> tuple[Any, Any]:
    """Return what spreads the light: the settings of lens and flares."""
    return config.get("lens"), config.get("flare")
