"""Output of `isethdr plugins`: components and presets, or all fields of one of them. Modules of a
run are not loaded.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from ..errors import ConfigError, did_you_mean
from ..plugins import registry
from ..plugins.component import KEYED, KINDS, Component
from ..plugins.descriptions import Description, descriptions
from ..plugins.field_docs import FieldRow
from ..plugins.presets import Preset, component_of, presets, values_of
from .terminal import console as open_console
from .terminal import print_text

# indents of a name, and of the text about it
FIELD = "  "
MORE = "      "


def print_plugins(kind: str = "", name: str = "") -> int:
    """Print the components and presets of a kind, of every kind, or the fields of one of them.

    Parameters
    ----------
    kind : one of `KINDS`; "" for all.
    name : a component or preset of this kind; "" lists their names.

    Returns
    -------
    int : number of broken plugins; they are printed last.

    Raises
    ------
    ConfigError : a kind or a name that is not installed.
    """
    if kind and kind not in KINDS:
        raise ConfigError(f"unknown kind {kind!r}{did_you_mean(kind, KINDS)}")
    if name:
        failed = _print_one(kind, name)
    else:
        failed = [broken for k in ([kind] if kind else KINDS) for broken in _print_kind(k)]
        example = kind or "sensor"
        print_text(f"Fields of one of them: isethdr plugins {example} NAME")
    every = [*registry.broken_plugins(), *failed]
    for broken in every:
        text = f"broken plugin {broken.entry_point} (package {broken.package}): {broken.reason}"
        open_console().print(text, style="bold red", soft_wrap=True)
    return len(every)


def choice(kind: str, name: str) -> str:
    """Return the text that chooses a component or preset on the command line."""
    return f"+{kind}@{kind}.KEY={name}" if kind in KEYED else f"{kind}={name}"


def _print_kind(kind: str) -> list[registry.BrokenPlugin]:
    """Print the names of one kind, each with its first paragraph."""
    members = [comp for comp in registry.components().values() if comp.kind == kind]
    shown, failed = descriptions(members)
    open_console().print(f"{kind}: choose with {choice(kind, 'NAME')}", style="bold")
    for comp in sorted(shown, key=lambda c: c.name):
        _print_name(comp.name, f"{shown[comp].summary} ({comp.package})")
    presets_of_kind = presets(kind)
    if presets_of_kind:
        print("  presets")
    for preset in presets_of_kind.values():
        _print_name(f"  {preset.name}", f"{_based(preset)}{preset.summary}")
    print()
    return failed


def _print_name(name: str, text: str) -> None:
    open_console().print(FIELD + name, style="cyan")
    print_text(text, MORE)


def _print_one(kind: str, name: str) -> list[registry.BrokenPlugin]:
    """Print the description of one component or preset, and its fields."""
    preset = presets(kind).get(name)
    of_kind = {n: comp for (k, n), comp in registry.components().items() if k == kind}
    component = of_kind.get(name if preset is None else component_of(preset))
    if component is None:
        choices = [*of_kind, *presets(kind)]
        raise ConfigError(f"{kind} {name!r} is not installed{did_you_mean(name, choices)}")
    shown, failed = descriptions([component])
    if component not in shown:
        return failed
    about = shown[component]
    open_console().print(f"{kind} {name}: choose with {choice(kind, name)}", style="bold")
    if preset is not None:
        print_text(f"{_based(preset)}{preset.summary}")
        print("\nsets")
        for field, (value, setter) in values_of(preset).items():
            origin = "" if setter == name else f"  (set by {setter})"
            print_text(f"{field}={value}{origin}", FIELD, MORE)
        print(f"\ncomponent {component.name}, with the values of {name}")
    for paragraph in (about.summary, *about.paragraphs):
        print_text(paragraph)
    _print_fields(kind, about, values_of(preset) if preset is not None else {})
    if preset is None:
        _print_presets_of(kind, component)
    return failed


def _print_fields(kind: str, about: Description, values: dict[str, tuple[str, str]]) -> None:
    """Print each field with its value, unit, range and meaning, by the class that defines it.

    Parameters
    ----------
    kind : kind of the component.
    about : description of the component.
    values : values of a preset by field, as `values_of` returns them; other fields have their
        defaults.
    """
    way = f"{kind}.KEY.FIELD=VALUE" if kind in KEYED else f"{kind}.FIELD=VALUE"
    print_text(f"Fields, set with {way}:" if about.fields else "It has no fields.")
    for origin, rows in groupby(about.fields, key=lambda row: row.origin):
        module, _, owner = origin.partition(":")
        print_text(f"defined by {owner} in {module}")
        for row in rows:
            value, _ = values.get(row.name, (row.default, ""))
            changed = f"  (default {row.default})" if value != row.default else ""
            print_text(field_text(replace(row, default=value)) + changed, FIELD, MORE)
            if row.meaning:
                print_text(row.meaning, MORE)


def field_text(row: FieldRow) -> str:
    """Return name, default, unit and allowed values of a field as one line."""
    unit = "" if row.unit in ("", "1") else row.unit
    range_and_unit = " ".join(part for part in (row.allowed.replace("`", ""), unit) if part)
    return f"{row.name}={row.default}" + (f"  [{range_and_unit}]" if range_and_unit else "")


def _print_presets_of(kind: str, component: Component) -> None:
    """Print the presets that are based on a component, with the fields that each sets."""
    own_presets = [p for p in presets(kind).values() if component_of(p) == component.name]
    if own_presets:
        print(f"\npresets of {component.name}")
    for preset in own_presets:
        own = "" if preset.based_on == component.name else _based(preset)
        _print_name(preset.name, f"{own}{preset.summary}")
        if preset.fields:
            print_text("sets " + ", ".join(f"{k}={v}" for k, v in preset.fields), MORE)


def _based(preset: Preset) -> str:
    return f"(from {preset.based_on}) " if preset.based_on else ""
