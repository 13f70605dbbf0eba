"""Sweeps (`-m`): their mistakes found before the first job, and fields of a swept kind that Hydra
would refuse.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hydra.core.override_parser.overrides_parser import OverridesParser

from ..errors import ConfigError, IsetHdrError
from ..pipeline.chain import chain
from ..plugins.component import KINDS
from ..runs.run import check_writable
from ..storage.store import home
from .composition import compose


def prepared(arguments: list[str]) -> list[str]:
    """Return the arguments of a sweep in the form that Hydra needs, after trying each of its
    values.

    Hydra composes once without the swept kinds. At that point `sensor.exposure_s=0.008` of
    `sensor=bayer,rgbw` belongs to no component, so such a field becomes a sweep with one value.
    Each swept value is composed and built once, not each combination.

    Raises
    ------
    ConfigError : a name, key or value is wrong; no job has started yet.
    CatalogError : no store could be written.
    """
    tried = _tried(arguments)
    check_writable(home())  # Hydra makes a folder for the sweep before the first job
    return tried


def _tried(arguments: list[str]) -> list[str]:
    flags = [a for a in arguments if a.startswith("-")]
    if not set(flags) <= {"-m", "--multirun"}:
        return arguments
    parsed = OverridesParser.create().parse_overrides(
        [a for a in arguments if not a.startswith("-")]
    )
    swept = {o.get_key_element() for o in parsed if o.is_sweep_override()} & set(KINDS)
    values = [_values(o) for o in parsed]
    first = [v[0] for v in values]
    for position, alternatives in enumerate(values):
        for alternative in alternatives if position == 0 else alternatives[1:]:
            job = [*first[:position], alternative, *first[position + 1 :]]
            choices = [o for o, tried in zip(job, values, strict=True) if len(tried) > 1]
            with _named(choices):
                chain(compose(job))
    return [
        *flags,
        *(
            _one_choice(o)
            if o.get_key_element().lstrip("+").split(".")[0] in swept
            else o.input_line
            for o in parsed
        ),
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


def _values(override) -> list[str]:
    if override.is_sweep_override() and override.is_discrete_sweep():
        return [f"{override.get_key_element()}={v}" for v in override.sweep_string_iterator()]
    return [override.input_line]


def _one_choice(override) -> str:
    key = override.get_key_element()
    if "." not in key or override.is_sweep_override() or override.is_delete():
        return override.input_line
    return f"{key}=choice({override.get_value_element_as_str()})"
