"""Lookup: kernels from the cache of this process, from disk, or else computed."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import is_dataclass, replace
from threading import Lock
from time import perf_counter
from typing import TYPE_CHECKING

from isethdr_core.runs import provenance

from .. import band_phase, kernel_store, memory
from . import computing, expected
from .patterns import one_pattern_frame
from .stored import store, stored, stored_halves

if TYPE_CHECKING:
    from ..kernel_request import KernelRequest
    from .kernel_set import Kernels

    Make = Callable[[KernelRequest], Kernels]

CACHE_BYTES = 3 << 30  # memory of the cached kernels that are not mapped from a file
REACH = 5  # index of the reach in a key of the cache; all entries before it are independent of it

_cache: OrderedDict[tuple, Kernels] = OrderedDict()
_lock = Lock()
_making: dict[tuple, Lock] = {}  # by key: other threads that need the same kernels wait for them


def kernels(request: KernelRequest, make: Make | None = None) -> Kernels:
    """Return the kernels of a lens with flares; they are cached in the process and on disk.

    Parameters
    ----------
    request : the kernels that are asked for.
    make : function(request) that computes the kernels by another method. Its results are stored on
        disk however fast they were computed.
    """
    key = _key(request, make)
    return once(key, lambda: _read_or_made(key, request, make))


def once(key: tuple, make: Callable[[], Kernels]) -> Kernels:
    """Return the kernels that this process holds under a key, or else make and keep them.

    Threads that need the same key wait for the first of them.

    Parameters
    ----------
    key : key of the cache.
    make : function that returns the kernels.
    """
    with _lock:
        making = _making.setdefault(key, Lock())
    with making:
        with _lock:
            if key in _cache:
                _cache.move_to_end(key)
                return _cache[key]
        made = make()
        with _lock:
            _cache[key] = made
            while len(_cache) > 1 and sum(k.held_bytes for k in _cache.values()) > CACHE_BYTES:
                _cache.popitem(last=False)
    return made


def forget() -> None:
    """Remove the kernels that this process holds; those on disk stay."""
    with _lock:
        _cache.clear()


def _read_or_made(key: tuple, request: KernelRequest, make: Make | None) -> Kernels:
    """Return kernels from disk, or else make and store them.

    Parameters
    ----------
    key : key of the kernels in this process.
    request, make : as in `kernels`.
    """
    name = name_of(request, make)
    frame = None if make else one_pattern_frame(request)
    found = stored(name) if frame is None else stored_halves(name, frame)
    if found is None:
        bands = len(request.wavelength_nm)
        memory.check_kernels(expected.held_bytes(request), bands, request.reach)
        band_phase.check(request.lens, request.flares, request.wavelength_nm)
        start = perf_counter()
        found = make(request) if make else computing.computed(request, name)
        worth_s = kernel_store.WORTH_KEEPING_S
        if frame is not None:
            worth_s = kernel_store.PATTERN_WORTH_KEEPING_S
        if name and (make or perf_counter() - start > worth_s):
            store(name, found)
            kernel_store.remove_parts(name)
            if frame is None:
                found = stored(name) or found  # map the file, and free the memory of the arrays
    return replace(found, key=key)


def at_hand(request: KernelRequest, shorter: float = 0.0) -> bool:
    """Return whether this process or the disk holds the kernels.

    Parameters
    ----------
    request : the kernels that are asked for.
    shorter : kernels with at most this share of the reach count too. The reach that a sensor needs
        is known only with the light.
    """
    without_reach = _key(request)[:REACH]
    with _lock:
        reaches = [key[REACH] for key in _cache if key[:REACH] == without_reach]
    name = name_of(request)
    if name is not None:
        reaches += kernel_store.reaches(name)
    return any(
        cached == request.reach or all(n <= shorter * r for n, r in zip(cached, request.reach))
        for cached in reaches
    )


def _key(request: KernelRequest, make: Make | None = None) -> tuple:
    flares = request.flares
    return (
        repr((request.lens, flares)),
        tuple(map(id, flares)) if any(not is_dataclass(f) for f in flares) else (),
        # a file may change while the process runs
        tuple(provenance.input_digests(request.lens, *flares).items()),
        tuple(request.edges_nm.ravel()),
        tuple(round(p, 9) for p in request.pitch_um),
        request.reach,
        make,
    )


def name_of(request: KernelRequest, make: Make | None = None) -> str | None:
    """Return the name of kernels on disk; None if they are not kept there.

    Parameters
    ----------
    request : the kernels that are asked for.
    make : as in `kernels`.
    """
    if not all(map(is_dataclass, (request.lens, *request.flares))):
        return None
    return kernel_store.name(request, make and make.__module__)
