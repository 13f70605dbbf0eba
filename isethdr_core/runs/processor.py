"""Processor: the processor that computed a result, and the code that libraries selected for it.

NumPy, BLAS and just-in-time compilers select instructions by processor. Sums are then rounded in
another order, and the last bits of a result may differ between two machines under one key. The
selection is recorded with each result. It is not part of the key, because all such results are
equally valid.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy
from threadpoolctl import threadpool_info

from ..errors import PluginError
from ..plugins.protocols import ChoosesKernels

# lines of /proc/cpuinfo that identify the processor, on x86 and on ARM
CPUINFO = ("vendor_id", "cpu family", "model", "model name", "CPU implementer", "CPU part")


def processors() -> int:
    """Return the number of processors that this process may use. A job on a shared machine may have
    fewer than the machine.
    """
    on_linux = sys.platform == "linux"
    return len(os.sched_getaffinity(0)) if on_linux else os.cpu_count() or 1


def threads_asked() -> int:
    """Return the number of threads that OMP_NUM_THREADS asks for; 0 if it does not."""
    # the variable may hold a list such as 2,1: one number for each level of parallel regions in
    # each other, of which the first counts here
    outer = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return int(outer) if outer.isdecimal() else 0


def kernels(*components: object) -> dict[str, str]:
    """Return the processor family, and the instructions that each library selected, by name of the
    library.

    Raises
    ------
    PluginError : a component returns no dictionary.
    """
    names = _of_process() | _linear_algebra()
    for component in components:
        if isinstance(component, ChoosesKernels):
            chosen = component.kernels()
            if not isinstance(chosen, Mapping):
                raise PluginError(
                    f"{type(component).__name__}.kernels() returned {chosen!r}; expected {{library:"
                    " instructions}; type `return {}` where there are none"
                )
            names |= chosen
    return names


@cache
def _of_process() -> dict[str, str]:
    return {"processor": _processor(), "numpy": _vector_instructions()}


def _processor() -> str:
    """Return the architecture, and the family and model of the processor if the system
    states them.
    """
    fields = {}
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        text = ""
    for line in text.split("\n\n")[0].splitlines():
        key, _, value = line.partition(":")
        fields[key.strip()] = value.strip()
    model = [f"{key} {fields[key]}" for key in CPUINFO if key in fields]
    if not model:
        return f"{platform.machine()} {platform.processor()}".strip()
    return ", ".join([platform.machine(), *model])


def _vector_instructions() -> str:
    """Return the instruction sets for which NumPy has loops and which this process uses."""
    extensions = numpy.show_config(mode="dicts").get("SIMD Extensions", {})
    return " ".join([*extensions.get("baseline", ()), *extensions.get("found", ())])


def _linear_algebra() -> dict[str, str]:
    """Return the kernel of each BLAS library that is loaded, by the folder of the library."""
    kernel_of = {}
    for library in threadpool_info():
        if library["user_api"] == "blas":
            kernel = (library.get(key) for key in ("internal_api", "version", "architecture"))
            folder = os.path.basename(os.path.dirname(library["filepath"]))
            kernel_of[f"blas in {folder}"] = " ".join(filter(None, kernel))
    return kernel_of
