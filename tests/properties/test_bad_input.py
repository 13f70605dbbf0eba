"""Any text for a field is accepted by the plan, or refused in one clear line: no crash, no hang."""

from __future__ import annotations

import math
import random
import signal
from contextlib import contextmanager
from dataclasses import fields
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from isethdr_core import compose
from isethdr_core.component import KEYED, KINDS
from isethdr_core.config.composition import explain
from isethdr_core.conformance.ranges import bad_fields
from isethdr_core.errors import ConfigError, IsetHdrError
from isethdr_core.ledger import Ledger
from isethdr_core.pipeline.chain import Chain, chain, plan
from isethdr_core.plugins.ranges import declared, field_types, undeclared
from isethdr_core.plugins.registry import build, components
from isethdr_core.runs.radiance_cache import held_and_missing
from isethdr_core.runs.run import run_key

LONGEST_S = 20  # longest CPU time of a plan
TINY = [
    "~versions",
    "~flare.dirt",
    "~cameras",
    "report=false",
    *(
        f"~metric.{name}"
        for name in (
            "dynamic_range",
            "snr",
            "colour",
            "ssim",
            "log_luminance",
            "contrast",
            "detection",
            "shares",
        )
    ),
]
QUICK = {"width": 16, "height": 12, "first_nm": 500.0, "last_nm": 600.0, "step_nm": 50.0}
NUMBERS = (
    "0",
    "-1",
    "1",
    "1.7",
    "1e-300",
    "1e-9",
    "-1e-9",
    "1e9",
    "1e30",
    "1e308",
    "-1e30",
    "nan",
    "inf",
    "-inf",
    "9223372036854775808",
    "-9223372036854775808",
    "1" + 40 * "0",
)
TEXTS = (
    "true",
    "null",
    "''",
    "abc",
    "' '",
    "'\u00fc\u221e\u6f22'",
    "'../../x'",
    "'x.yaml'",
    "'/'",
    "'nan'",
    "'1e3'",
    "'a\tb'",
    "'\x01'",
)
NESTED = (
    "[]",
    "{}",
    "[1,2]",
    "[2,1]",
    "[nan,nan]",
    "[1e30,-1e30]",
    "[0,1e308]",
    "[[1,2],[3]]",
    "[null]",
    "[[nan,1],[2,inf]]",
    "[a,b]",
    "{a:1}",
    "{a:{b:[1,{c:null}]}}",
    "{1:nan}",
    "{-5:1}",
    "{4:1e30}",
    "{0:1,20:inf}",
    "{0:{4:nan},20:{}}",
    "{sky:-1}",
    "{sky:nan}",
    "{sky:{cd_m2:nan}}",
    "{sky:{frequency_hz:inf,duty:2}}",
    "{model:brown_conrady,k1:nan}",
    "{model:brown_conrady,k1:1e9}",
    "{model:kannala_brandt,k1:inf}",
    "{model:table,angle_deg:[0,1],radius_per_focal_length:[nan,1]}",
    "{model:[1]}",
    "{model:table}",
    "[[[[[[1]]]]]]",
)


@cache
def turn(number: int) -> tuple[Any, dict[str, str]]:
    """Return a config with component `number` of every kind, and {place in the config: kind}."""
    members = {kind: sorted(n for k, n in components() if k == kind) for kind in KINDS}
    names = {kind: of_kind[number % len(of_kind)] for kind, of_kind in members.items()}
    typed = [
        f"+{kind}@{kind}.new={name}" if kind in KEYED else f"{kind}={name}"
        for kind, name in names.items()
    ]
    where = {f"{kind}.new" if kind in KEYED else kind: kind for kind in KINDS}
    if names["scene"] not in ("night_drive", "tunnel"):
        typed[typed.index(f"renderer={names['renderer']}")] = "~renderer"
        del where["renderer"]
    config = compose([*TINY, *typed])
    for node in (config.scene, config.get("renderer") or {}):
        node.update({key: value for key, value in QUICK.items() if key in node})
    return config, where


def draws(seed: int, count: int, turns: int):
    """Yield (turn, place, field, text typed for it) for random fields of random components."""
    drawn = random.Random(seed)
    for _ in range(count):
        number = drawn.randrange(turns)
        config, where = turn(number)
        place = drawn.choice(sorted(where))
        keys = [key for key in OmegaConf.select(config, place) if key != "name"]
        if keys:
            key = drawn.choice(keys)
            name = OmegaConf.select(config, place).name
            cls = components()[where[place], name].cls
            yield number, place, key, typed(drawn, field_types(cls)[key])


def typed(drawn: random.Random, annotation: Any) -> str:
    """Return a text to type for a field: mostly of its type, sometimes of any other type."""
    if drawn.random() < 0.2:
        return drawn.choice(NUMBERS + TEXTS + NESTED)
    if limits := declared(annotation):
        low = max(limits.least, -1e30)
        high = min(limits.most, 1e30)
        small = max(low, 1e-12)
        inside = (low, high, (low + high) / 2, small * (high / small) ** drawn.random())
        whole = get_args(annotation)[0] is int
        number = drawn.choice([*NUMBERS, *(round(v) if whole else v for v in inside)])
        return str(number)
    if annotation is str or get_origin(annotation) is Literal:
        return drawn.choice(TEXTS)
    if annotation is bool:
        return drawn.choice(NUMBERS + TEXTS)
    if get_origin(annotation) is tuple:
        return (
            f"[{','.join(typed(drawn, part) for part in get_args(annotation) if part is not ...)}]"
        )
    if get_origin(annotation) is dict and drawn.random() < 0.5:
        key, value = (typed(drawn, part) for part in get_args(annotation))
        return f"{{{key}:{value}}}"
    if get_origin(annotation) in (Union, UnionType):
        return typed(drawn, drawn.choice(get_args(annotation)))
    return drawn.choice(NESTED)


def planned(number: int, place: str, key: str, text: str) -> Chain:
    """Plan the config of a turn with one override, as the command line does."""
    config = turn(number)[0].copy()
    try:
        override = OverridesParser.create().parse_override(f"{place}.{key}={text}")
        OmegaConf.update(config, f"{place}.{key}", override.value(), merge=True)
    except (HydraException, OmegaConfBaseException) as err:
        raise ConfigError(explain(err)) from None
    parts = chain(config)
    demand = plan(parts, Ledger())
    run_key(config, parts)
    held_and_missing(parts, demand)
    return parts


@contextmanager
def at_most(seconds: float):
    """Raise TimeoutError in the block when it has used `seconds` of CPU time."""

    def late(number, frame):
        raise TimeoutError(f"longer than {seconds} s")

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def inside(annotation: Any, value: Any) -> bool:
    """Return whether all numbers of a value lie in their ranges, by other code than `build`."""
    origin = get_origin(annotation)
    parts = get_args(annotation)
    if limits := declared(annotation):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return number and limits.least <= value <= limits.most
    if origin is Annotated:
        return inside(parts[0], value)
    if annotation in (int, float):
        return isinstance(value, (int, float)) and math.isfinite(value)
    if origin in (Union, UnionType):
        return any(inside(part, value) for part in parts)
    if origin is dict:
        return isinstance(value, dict) and all(
            inside(parts[0], k) and inside(parts[1], v) for k, v in value.items()
        )
    if origin is tuple:
        return isinstance(value, tuple) and all(
            inside(parts[0] if parts[-1] is Ellipsis else parts[k], v) for k, v in enumerate(value)
        )
    return True


def trouble(seed: int, count: int, turns: int) -> list[str]:
    """Return one line for each draw that was neither planned nor refused as it should be."""
    found = []
    for number, place, key, text in draws(seed, count, turns):
        name = OmegaConf.select(turn(number)[0], place).name
        case = f"turn {number} {name}: {place}.{key}={text}"
        try:
            with at_most(LONGEST_S):
                parts = planned(number, place, key, text)
        except IsetHdrError as refusal:
            if len(str(refusal)) < 25 or "\n" in str(refusal):
                found.append(f"{case}: says {refusal}")
        except Exception as crash:
            found.append(f"{case}: {type(crash).__name__}: {crash}")
        else:
            found += [
                f"{case}: accepted {f.name}"
                for part in parts.components()
                for f in fields(part)
                if not inside(field_types(type(part))[f.name], getattr(part, f.name))
            ]
    return found


def test_bad_input_is_planned_or_refused():
    assert not trouble(1, 50, 2)


@pytest.mark.slow  # every component
def test_much_bad_input_is_planned_or_refused():
    assert not trouble(2, 1500, max(sum(k == kind for k, _ in components()) for kind in KINDS))


def test_every_number_of_a_bundled_component_declares_its_range():
    without = [
        f"{comp.kind} {comp.name}: {name}"
        for comp in components().values()
        for name, annotation in field_types(comp.cls).items()
        if undeclared(annotation)
    ]
    assert not without


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_outside_a_range_is_built(kind):
    for name in sorted(n for k, n in components() if k == kind):
        for bad in bad_fields(build(kind, name)):
            with pytest.raises(ConfigError, match="expected"):
                build(kind, name, **bad)
