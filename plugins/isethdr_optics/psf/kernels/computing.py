"""Computing kernels: choice of the method for a request."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lattices import of_lattices
from .patterns import of_one_pattern, of_phase_patterns, one_pattern_frame, phase_frame

if TYPE_CHECKING:
    from ..kernel_request import KernelRequest
    from .kernel_set import Kernels


def computed(request: KernelRequest, name: str | None = None) -> Kernels:
    """Compute and return kernels, without a look into the cache of whole kernels.

    Parameters
    ----------
    request : the kernels that are asked for.
    name : name of the kernels on disk, where single bands that take long are kept; None: nowhere.
    """
    frame = one_pattern_frame(request)
    if frame is not None:
        return of_one_pattern(frame)
    frame = phase_frame(request)
    if frame is not None:
        return of_phase_patterns(frame)
    return of_lattices(request, name)
