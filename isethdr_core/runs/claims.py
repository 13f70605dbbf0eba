"""Claims: if several processes need the same scene, one renders it and the others wait.

A claim is a hidden file beside the stores, `.<name>.claim-<number>`, which only one process can
create. The process that holds it changes the time of the file every few seconds: the heartbeat. A
claim is dead if its process on this machine has ended, or if the time has not changed for a while
by the clock of the waiting process. Times of two machines are never compared, so their clocks may
differ.

A dead claim is taken over by creating the next number, which again only one process can do. The
process with the highest number holds the claim.
"""

from __future__ import annotations

import json
import os
import random
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

UNKNOWN = "unknown"  # in place of a start time, if the system hides the process


@dataclass(frozen=True)
class Rhythm:
    """Intervals of the heartbeat, and of the checks by waiting processes."""

    beat_s: float = 5.0  # time between two heartbeats
    dead_after_s: float = 60.0  # a process that is merely slow must not lose its claim
    look_s: float = 0.5  # time between two checks by a waiting process


@dataclass(frozen=True)
class _Claim:
    """A claim of this process: its open file, and the thread of the heartbeat."""

    path: Path
    file: int
    stop: threading.Event
    thread: threading.Thread

    @property
    def number(self) -> int:
        return _number(self.path)

    def release(self) -> None:
        """Remove the claim, unless another process has taken its place."""
        self.stop.set()
        self.thread.join()
        try:
            with suppress(FileNotFoundError):
                if os.path.samestat(os.stat(self.path), os.fstat(self.file)):
                    self.path.unlink()
        finally:
            os.close(self.file)


@contextmanager
def claimed(
    folder: Path, name: str, tell: Callable[[str], None], rhythm: Rhythm = Rhythm()
) -> Iterator[bool]:
    """Hold the claim `name` in `folder` while the block runs. Wait first if another process holds
    it.

    Parameters
    ----------
    folder : folder of the stores.
    name : name of the claim.
    tell : called with one line of text whenever this process begins to wait for another one.
    rhythm : intervals of the heartbeat and of the checks, s.

    Yields
    ------
    bool : whether this process had to wait.

    Raises
    ------
    OSError : the folder cannot be written.
    """
    claim, waited = _acquired(folder, name, tell, rhythm)
    try:
        for path in _claims(folder, name):
            if _number(path) < claim.number:
                path.unlink(missing_ok=True)
        _remove_dead(folder)
        yield waited
    finally:
        claim.release()


def _acquired(
    folder: Path, name: str, tell: Callable[..., Any], rhythm: Rhythm
) -> tuple[_Claim, bool]:
    waited = False
    watch = _Watch(rhythm)
    while True:
        earlier_claims = _claims(folder, name)
        if earlier_claims and not watch.is_dead(earlier_claims[-1]):
            if watch.is_new():
                tell(f"waiting for {name}: {_described(earlier_claims[-1])} computes it")
            waited = True
            time.sleep(rhythm.look_s)
            continue
        number = _number(earlier_claims[-1]) + 1 if earlier_claims else 0
        claim = _created(folder / f".{name}.claim-{number}", rhythm)
        if claim is None:  # another process was faster
            continue
        later_claims = _claims(folder, name)
        # if the dead claim has disappeared, another process took it over and has finished
        if (
            later_claims
            and later_claims[-1] == claim.path
            and (not earlier_claims or earlier_claims[-1] in later_claims)
        ):
            return claim, waited
        claim.release()
        time.sleep(rhythm.look_s * random.random())


class _Watch:
    """Decides whether the process that holds a claim is alive, from what a waiting process can
    read.
    """

    def __init__(self, rhythm: Rhythm) -> None:
        self.rhythm = rhythm
        self.state: tuple = ()
        self.since_s = 0.0
        self.told: tuple = ()

    def is_dead(self, path: Path) -> bool:
        """Return whether the process of a claim has ended, or its heartbeat has stopped."""
        try:
            # opening the file makes a network file system ask its server
            with open(path, "rb") as file:
                status = os.fstat(file.fileno())
                owner = _owner(file.read())
        except FileNotFoundError:
            return False
        state = (str(path), status.st_ino, status.st_mtime_ns, owner.get("process"))
        if state != self.state:
            self.state = state
            self.since_s = time.monotonic()
        return _has_ended(owner) or time.monotonic() - self.since_s > self.rhythm.dead_after_s

    def is_new(self) -> bool:
        """Return True on the first call for each holder, otherwise False."""
        holder = (*self.state[:2], *self.state[3:])
        new = holder != self.told
        self.told = holder
        return new


def _created(path: Path, rhythm: Rhythm) -> _Claim | None:
    try:
        file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR)
    except FileExistsError:
        return None
    since = datetime.now(UTC).isoformat(timespec="seconds")
    owner = _machine() | {"process": os.getpid(), "started": _started(os.getpid()), "since": since}
    os.write(file, json.dumps(owner).encode())
    stop = threading.Event()
    thread = threading.Thread(target=_beat, args=(file, stop, rhythm.beat_s), daemon=True)
    thread.start()
    return _Claim(path, file, stop, thread)


def _beat(file: int, stop: threading.Event, beat_s: float) -> None:
    while not stop.wait(beat_s):
        with suppress(OSError):  # a network that is down for a moment
            os.utime(file)


def _claims(folder: Path, name: str) -> list[Path]:
    """Return the files of all claims of a name, the holder's last."""
    prefix = f".{name}.claim-"
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries if entry.name.startswith(prefix)]
    return sorted((folder / n for n in names if n.removeprefix(prefix).isdigit()), key=_number)


def _number(path: Path) -> int:
    return int(path.name.rpartition("-")[2])


def _owner(text: bytes) -> dict:
    try:
        owner = json.loads(text)
    except ValueError:  # its holder is about to write it
        return {}
    return owner if isinstance(owner, dict) else {}


def _remove_dead(folder: Path) -> None:
    """Remove claims of any name that killed processes of this machine left."""
    for path in folder.glob(".*.claim-*"):
        with suppress(OSError):  # its holder has just removed it
            if _has_ended(_owner(path.read_bytes())):
                path.unlink()


def _described(path: Path) -> str:
    try:
        owner = _owner(path.read_bytes())
    except OSError:
        owner = {}
    if not owner:
        return "another process"
    return f"process {owner.get('process')} on {owner.get('host')} since {owner.get('since')}"


def _machine() -> dict[str, str]:
    """Return a name of the machine. Processes with the same name can check each other by process
    number.
    """
    try:
        # containers of one host have their own process numbers
        namespace = os.readlink("/proc/self/ns/pid")
    except OSError:
        namespace = ""
    return {"host": socket.gethostname(), "namespace": namespace}


def _has_ended(owner: dict) -> bool:
    """Return whether the process of a claim ran on this machine and has ended."""
    if not owner or any(owner.get(key) != value for key, value in _machine().items()):
        return False
    started = _started(owner["process"])
    return started is None or started not in (owner["started"], UNKNOWN)


def _started(process: int) -> str | None:
    """Return the start time of a process in ticks of the machine; `UNKNOWN` if the system does not
    show it; None if the process has ended.

    The number of an ended process may be given to a new one, but the pair of number and start time
    is unique. Some systems hide the processes of other users below /proc.
    """
    try:
        text = Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return UNKNOWN if _answers(process) else None
    except ProcessLookupError:  # it has ended while the file was read
        return None
    state, *fields = text.rpartition(")")[2].split()
    return None if state in "ZX" else fields[18]


def _answers(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # the process is alive and belongs to another user
        return True
    return True
