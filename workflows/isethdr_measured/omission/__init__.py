"""Omission: runs that leave out unneeded work, against the same runs that compute everything.

| file       | content                                                          |
|------------|------------------------------------------------------------------|
| `cases`    | ten scenes and cameras with very different needs                 |
| `compare`  | both runs of a case: work, largest difference, and its bound     |
"""

from __future__ import annotations

from isethdr_core.cli.progress import track
from isethdr_core.errors import ConfigError, did_you_mean

from .cases import CASES
from .compare import compared, warmed


def omission(case: str = "", rendered: int = 1) -> list[dict]:
    """Run ten cases with omissions and without them; compare work and results.

    Parameters
    ----------
    case : name of one case; empty takes all.
    rendered : 0 leaves out the rendered cases, which take minutes.

    Returns
    -------
    rows with case, its omissions, CPU seconds of the run and of the run with `leave_out=false` (the
    least of two runs each, or of five for cases that are not rendered), the ratio of the second to
    the first, the seconds of the plan as percent of the second, the difference and the bound of the
    reading that comes nearest to its bound, in electrons, and agree (the difference is within the
    bound).

    Raises
    ------
    ConfigError : there is no such case.
    """
    known = {name: entry for name, entry in CASES.items() if rendered or not entry.rendered}
    if case and case not in known:
        raise ConfigError(f"study omission has no case {case!r}{did_you_mean(case, known)}")
    chosen = [case] if case else list(known)
    warmed([known[name] for name in chosen if known[name].rendered])
    return [compared(name, known[name]) for name in track(chosen, "cases")]
