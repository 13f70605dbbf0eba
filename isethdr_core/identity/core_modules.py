"""Core modules: those that components compute with, and those that change no result.

All other modules of the core are the frame, which runs the chain.
"""

from __future__ import annotations

from dataclasses import dataclass

CORE = "isethdr_core"
SECOND_SPELLING = "isethdr"  # module with the same public names
# modules that components compute with; every other part of the core belongs to the frame
FOLLOWED = (
    "isethdr_core.physics",
    "isethdr_core.lighting",
    "isethdr_core.data",
    "isethdr_core.display",
    "isethdr_core.onnx_session",
)
# parts of the core that change no result: what is shown, written, waited for, refused or estimated
WITHOUT_RESULT = (
    "isethdr_core.cli",
    "isethdr_core.config",
    "isethdr_core.conformance",
    "isethdr_core.errors",
    "isethdr_core.identity",
    "isethdr_core.pipeline.memory_estimate",
    "isethdr_core.pipeline.runtime_estimate",
    "isethdr_core.plugins.hookspecs",
    "isethdr_core.results",
    "isethdr_core.runs.claims",
    "isethdr_core.runs.labels",
    "isethdr_core.runs.names",
    "isethdr_core.runs.parent_watch",
    "isethdr_core.runs.processor",
    "isethdr_core.runs.provenance",
    "isethdr_core.storage.arrays",
    "isethdr_core.storage.atomic_write",
    "isethdr_core.storage.bounded_cache",
    "isethdr_core.storage.exact_encoding",
    "isethdr_core.storage.home_folder",
    "isethdr_core.storage.join",
    "isethdr_core.storage.manifest",
    "isethdr_core.storage.object_home",
    "isethdr_core.storage.reader",
    "isethdr_core.storage.store",
    "isethdr_core.sweeps",
)


@dataclass(frozen=True)
class Rules:
    """Which modules of the core a digest follows."""

    core: str = CORE
    followed: tuple[str, ...] = FOLLOWED  # belong to the components that reach them
    without_result: tuple[str, ...] = WITHOUT_RESULT  # never followed

    def is_core(self, module: str) -> bool:
        """Return whether a module belongs to the core."""
        return module.partition(".")[0] == self.core

    def follows(self, module: str) -> bool:
        """Return whether a digest follows an import of this module, of the core or not."""
        if not self.is_core(module):
            return True
        return within(module, self.followed) and not within(module, self.without_result)


def within(module: str, packages: tuple[str, ...]) -> bool:
    """Return whether a module is one of `packages`, or lies in one of them."""
    return module in packages or module.startswith(tuple(f"{p}." for p in packages))
