"""Demand: what is still needed, passed from the scores back to the scene before anything is computed.

Any component may have a method `narrow(demand) -> Demand` that returns a smaller demand and says
with `ledger.left_out` what it dropped, why, and what dropping it can change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Demand:
    """What the stages to the right still need of the stages to the left. None means all there is."""

    groups: tuple[str, ...] | None = None           # light groups
    wavelength_nm: tuple[float, ...] | None = None  # band centres
    labels: frozenset[str] = frozenset()            # depth, distance, instance, category, normal
    error_allowed: float = 0.0                      # relative; 0 asks for the exact way

    def with_groups(self, groups) -> Demand:
        """Return the demand for no other light group than `groups`."""
        kept = tuple(g for g in groups if self.groups is None or g in self.groups)
        return replace(self, groups=kept)

    def with_labels(self, *labels: str) -> Demand:
        """Return the demand that also asks for `labels`."""
        return replace(self, labels=self.labels | set(labels))
