"""Sweeps (`-m`): mistakes are found before the first job. Fields of a swept kind are rewritten,
because Hydra would refuse them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import compress
from pathlib import Path

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override

from ..cli.sweep_progress import watched as watched
from ..cli.sweep_summary import finish as finish
from ..errors import ConfigError, IsetHdrError
from ..pipeline.chain import chain
from ..plugins.component import KINDS
from ..runs.labels import SETTINGS, checked, labels_of
from ..runs.run import check_writable
from ..storage.store import home
from ..sweeps.record import Sweep, check_free, name_of
from .composition import compose

NAME = "name"  # setting with the name of a sweep or a run


@dataclass(frozen=True)
class Prepared:
    """A sweep whose values have all been tried."""

    arguments: list[str]  # in the form that Hydra needs
    sweep: Sweep | None  # None where Hydra only shows something, for example with `--cfg job`


def prepared(arguments: list[str]) -> Prepared:
    """Return a sweep in the form that Hydra needs, after each of its values has been tried.

    Hydra first composes once without the swept kinds. In `sensor=bayer,rgbw
    sensor.exposure_s=0.008` the field has no owner then, so it is rewritten as a sweep of one
    choice. Each swept value is composed and built once, not each combination. The name of the sweep
    does not change the jobs. It is removed from them and becomes the name of their folder.

    Raises
    ------
    ConfigError : a name, key or value is wrong, or another sweep has this name; no job has started
        yet.
    CatalogError : no store could be written.
    """
    flags = [a for a in arguments if a.startswith("-")]
    if not set(flags) <= {"-m", "--multirun"}:
        return Prepared(arguments, None)
    typed = [a for a in arguments if not a.startswith("-")]
    overrides = OverridesParser.create().parse_overrides(typed)
    own = [o for o in overrides if o.get_key_element() != NAME]
    jobs = [o for o in own if not o.is_hydra_override() and o.get_key_element() not in SETTINGS]
    overrides_typed = tuple(o.input_line for o in jobs)
    swept = [o for o in jobs if o.is_sweep_override()]
    name = next((o.value() for o in overrides if o.get_key_element() == NAME), None)
    sweep = Sweep(
        checked("name", name or name_of(overrides_typed)),
        overrides_typed,
        tuple(o.get_key_element().lstrip("+") for o in swept),
        math.prod(len(_values(o)) for o in swept),
    )
    check_free(sweep)
    tried = _tried(own)
    check_writable(home())  # Hydra makes a folder for the sweep before the first job
    return Prepared([*flags, *tried, f"hydra.sweep.dir={_quoted(sweep.folder)}"], sweep)


def _quoted(path: Path) -> str:
    text = str(path).replace("\\", "\\\\").replace("'", "\\'")
    return f"'{text}'"


def _tried(parsed: list[Override]) -> list[str]:
    swept = {o.get_key_element() for o in parsed if o.is_sweep_override()} & set(KINDS)
    values = [_values(o) for o in parsed]
    first = [v[0] for v in values]
    # settings of Hydra are tried once: with them, composing reads all config files again
    is_of_chain = [not o.is_hydra_override() for o in parsed]
    is_first = True
    for position, alternatives in enumerate(values):
        for alternative in alternatives if position == 0 else alternatives[1:]:
            job = [*first[:position], alternative, *first[position + 1 :]]
            choices = [o for o, tried in zip(job, values, strict=True) if len(tried) > 1]
            with _named(choices):
                config = compose(job if is_first else list(compress(job, is_of_chain)))
                labels_of(config)
                chain(config)
            is_first = False
    return [
        _one_choice(o) if o.get_key_element().lstrip("+").split(".")[0] in swept else o.input_line
        for o in parsed
    ]


@contextmanager
def _named(choices: list[str]) -> Iterator[None]:
    """Add the overrides `choices` of a job to the message of its error."""
    try:
        yield
    except IsetHdrError as err:
        if not choices:
            raise
        raise ConfigError(f"job {' '.join(choices)}: {err}") from None


def _values(override: Override) -> list[str]:
    if override.is_sweep_override() and override.is_discrete_sweep():
        return [f"{override.get_key_element()}={v}" for v in override.sweep_string_iterator()]
    return [override.input_line]


def _one_choice(override: Override) -> str:
    key = override.get_key_element()
    if "." not in key or override.is_sweep_override() or override.is_delete():
        return override.input_line
    return f"{key}=choice({override.get_value_element_as_str()})"
