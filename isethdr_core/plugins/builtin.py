"""Components of the core: the members of the kind lighting."""

from __future__ import annotations

from ..lighting import COMPONENTS
from .component import Component
from .hookspecs import hookimpl


@hookimpl
def isethdr_components() -> list[Component]:
    """Return the lighting components."""
    return COMPONENTS
