"""Component: what a plugin offers under `kind/name`. Stage: one component at work in a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

KINDS = ("scene", "renderer", "lighting", "lens", "flare", "sensor", "isp", "metric")
KEYED = ("flare", "metric")  # kinds with several members in a run, under names that users choose


@dataclass(frozen=True)
class Component:
    """A frozen dataclass offered under `kind/name`; its fields become the Hydra config group
    entry.
    """

    kind: str
    name: str
    cls: type


@dataclass
class Stage:
    """One component while it runs: the argument of the stage hooks."""

    kind: str
    name: str
    component: Any
    result: Any = None
    row: Any = None
    error: BaseException | None = field(default=None)
