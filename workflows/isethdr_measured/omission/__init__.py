"""Omission: runs that leave out what they do not need beside the same runs that compute everything.

| file       | content                                                          |
|------------|------------------------------------------------------------------|
| `cases`    | ten scenes and cameras of very different need                    |
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
    case : one case only; empty takes all.
    rendered : 0 leaves out the rendered cases, which take minutes.

    Returns
    -------
    rows with case, omissions of its plan, CPU seconds of the run and of the run with
    `leave_out=false` (the least of two each; of five without rendering), their ratio, the share of
    the plan in the second, the difference and the bound of the reading nearest to its bound, in
    electrons, and agree.

    Raises
    ------
    ConfigError : no such case.
    """
    known = {name: entry for name, entry in CASES.items() if rendered or not entry.rendered}
    if case and case not in known:
        raise ConfigError(f"study omission has no case {case!r}{did_you_mean(case, known)}")
    chosen = [case] if case else list(known)
    warmed([known[name] for name in chosen if known[name].rendered])
    return [compared(name, known[name]) for name in track(chosen, "cases")]
