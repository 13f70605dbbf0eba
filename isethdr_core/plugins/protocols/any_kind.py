"""Abilities that a component of any kind may offer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

if TYPE_CHECKING:
    from os import PathLike

    from ...pipeline.demand import Demand
    from ..accuracy_knobs import AccuracyKnob, ErrorShare


@runtime_checkable
class NarrowsDemand(Protocol):
    """A component that needs less from earlier stages than the later stages request."""

    def narrow(self, demand: Demand, /) -> Demand:
        """Return a smaller demand. The dropped part must not matter to the component.

        The dropped part is stated with `ledger.left_out`.
        """


@runtime_checkable
class ReadsFiles(Protocol):
    """A component whose result depends on the content of files."""

    def input_files(self) -> Iterable[str | PathLike[str]]:
        """Return the paths of those files; their content is part of a run's name.

        A folder stands for all files below it, also in linked folders.
        """


@runtime_checkable
class RunsPrograms(Protocol):
    """A component whose result depends on programs that it starts."""

    def programs(self) -> dict[str, str]:
        """Return {program: version} of those in use; they are part of a run's name."""
        ...


@runtime_checkable
class ChoosesKernels(Protocol):
    """A component whose library compiles or picks code for the processor."""

    def kernels(self) -> dict[str, str]:
        """Return {library: its selection in this process} for the libraries in use."""
        ...


@runtime_checkable
class DeclaresAccuracy(Protocol):
    """A component with fields that trade accuracy for time."""

    # fields that a study varies and that a budget may set
    accuracy_knobs: ClassVar[Sequence[AccuracyKnob]]


@runtime_checkable
class DividesErrorAllowed(Protocol):
    """A lens that itself divides the error allowed among its approximations."""

    # shares of the error allowed, with their costs; the lens receives the sum of the shares
    error_shares: ClassVar[Sequence[ErrorShare]]


@runtime_checkable
class ThreadSafe(Protocol):
    """A component that several threads may call at the same time.

    Its results then depend on its fields and arguments alone, and its call changes nothing that
    another call reads. Each thread has a scene and a renderer of its own. A plugin with hooks
    around stages may declare the same.
    """

    # True: several threads may call it; also valid for subclasses, unless they set False
    THREAD_SAFE: ClassVar[bool]


ABILITIES: tuple[type, ...] = (
    NarrowsDemand,
    ReadsFiles,
    RunsPrograms,
    ChoosesKernels,
    DeclaresAccuracy,
    DividesErrorAllowed,  # refused for kinds other than lens
    ThreadSafe,
)
