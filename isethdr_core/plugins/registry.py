"""Collect plugins with pluggy and look components up by `kind/name`.

Bundled plugins come through the same entry points as third-party ones. The environment variable
ISETHDR_PLUGINS limits them: `all` (default), or a comma-separated list of entry point names.
"""

from __future__ import annotations

import ast
import dataclasses
import logging
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata, util
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pluggy

from ..errors import ConfigError, PluginError, did_you_mean
from . import abilities, hookspecs
from .component import KEYED, KINDS, PLUGIN_API, Component
from .ranges import converted

if TYPE_CHECKING:
    from omegaconf import DictConfig

log = logging.getLogger(__name__)
PLACE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")  # package.module:Class
API_ASKED = "ISETHDR_PLUGIN_API"  # name in a plugin's module: the `PLUGIN_API` that it relies on
# the command line reads names in these forms as texts, except `VALUE_WORDS` and numbers
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
NUMBER = re.compile(r"(0|[1-9](_?\d)*)(\.(\d(_?\d)*)?)?([eE][+-]?\d+)?")
# keys of a component's table in the config that cannot be fields: {key: its use}
TAKEN = {"name": "the name of the component", "defaults": "Hydra's list of defaults"}
VALUE_WORDS = frozenset({"true", "false", "null", "nan", "inf"})  # values in upper case as well


@dataclass(frozen=True)
class BrokenPlugin:
    """A plugin that did not load: its entry point, its package, and why."""

    entry_point: str
    package: str
    reason: str


_broken: list[BrokenPlugin] = []


@cache
def plugin_manager() -> pluggy.PluginManager:
    """Load every installed plugin once. A plugin that fails is logged as an error and skipped."""
    pm = pluggy.PluginManager(hookspecs.PROJECT)
    pm.add_hookspecs(hookspecs)
    enabled = os.environ.get("ISETHDR_PLUGINS", "all").strip()
    entries = metadata.entry_points(group=hookspecs.PROJECT)
    if enabled != "all":
        _warn_of_unknown(enabled, {entry.name for entry in entries})
    for entry in sorted(entries, key=lambda e: (e.name, package_of(e))):
        if enabled != "all" and entry.name not in map(str.strip, enabled.split(",")):
            continue
        # entry points of two packages may share a name, but pluggy needs unique names
        name = f"{entry.name} of {package_of(entry)}" if pm.has_plugin(entry.name) else entry.name
        try:
            plugin = entry.load()
            _refuse_newer(getattr(plugin, API_ASKED, 1))
            pm.register(plugin, name=name)
            _refuse_unknown_hooks(pm, name, plugin)
        # the code of a third party may raise anything, and a script ends the process
        except (Exception, SystemExit) as err:
            if pm.has_plugin(name):
                pm.unregister(name=name)
            reason = _newer_by_source(entry) or _said(err)
            _broken.append(BrokenPlugin(entry.name, package_of(entry), reason))
            log.error(
                "plugin %r of package %r did not load and is skipped (%s)",
                entry.name,
                package_of(entry),
                reason,
            )
    return pm


def _said(err: BaseException) -> str:
    """Return the type and the message of an error in one line; errors of pluggy have several."""
    said = f"{type(err).__name__}: {' '.join(str(err).split())}"
    if isinstance(err, SystemExit):
        said += '; it must not exit while it loads; put such lines below if __name__ == "__main__":'
    return said


def _warn_of_unknown(enabled: str, known: set[str]) -> None:
    """Log a warning for each name in ISETHDR_PLUGINS that no installed package offers.

    Parameters
    ----------
    enabled : value of ISETHDR_PLUGINS, a list of names.
    known : names of the entry points that are installed.
    """
    for name in map(str.strip, enabled.split(",")):
        if name and name not in known:
            log.warning(
                "ISETHDR_PLUGINS names %r, which no installed package offers%s",
                name,
                did_you_mean(name, known),
            )


def broken_plugins() -> tuple[BrokenPlugin, ...]:
    """Return the plugins that did not load."""
    components()
    return tuple(_broken)


@cache
def components() -> dict[tuple[str, str], Component]:
    """Return every component by (kind, name).

    Raises
    ------
    PluginError : two plugins offer the same kind and name; both packages are named.
    """
    pm = plugin_manager()
    by_name: dict[tuple[str, str], Component] = {}
    for impl in pm.hook.isethdr_components.get_hookimpls():
        try:
            returned: Any = impl.function()
            offered: list[Component] = list(returned)
            for comp in offered:
                _check(comp)
        except (Exception, SystemExit) as err:
            reason = _said(err)
            _broken.append(BrokenPlugin(impl.plugin_name, _package_name(impl.plugin), reason))
            log.error(
                "plugin %r offers components that cannot be used and is skipped (%s)",
                impl.plugin_name,
                reason,
            )
            continue
        for comp in offered:
            if reason := _why_not_typed(comp):
                _broken.append(BrokenPlugin(impl.plugin_name, _package_name(impl.plugin), reason))
                log.error("plugin %r: %s; it is left out", impl.plugin_name, reason)
                continue
            key = (comp.kind, comp.name)
            if key in by_name:
                raise PluginError(
                    f"two plugins offer {comp.kind}/{comp.name}:"
                    f" {package_of_component(by_name[key])}"
                    f" and {package_of_component(comp)}; rename one, or leave one out with"
                    " ISETHDR_PLUGINS"
                )
            by_name[key] = comp
    return by_name


def build(kind: str, name: str, /, **fields: Any) -> Any:
    """Return a component, its fields checked and converted.

    Parameters
    ----------
    kind : kind of the component, for example `lens`.
    name : registered name of the component.
    fields : fields of the component, by name; others keep their defaults.

    Raises
    ------
    ConfigError : unknown kind, name or field (with the nearest valid one), or a value of the wrong
        type or outside the range that its field declares.
    PluginError : the class of the component cannot be imported, or breaks its contract.
    """
    if kind not in KINDS:
        raise ConfigError(f"unknown kind {kind!r}{did_you_mean(kind, KINDS)}")
    components_of_kind = {n: c for (k, n), c in components().items() if k == kind}
    if name not in components_of_kind:
        raise ConfigError(
            f"{kind} {name!r} is not installed{did_you_mean(name, components_of_kind)}; these are"
            " the components; presets are chosen with isethdr_core.compose or on the command line"
        )
    cls = class_of(components_of_kind[name])
    allowed = [f.name for f in dataclasses.fields(cls) if f.init]
    for key in fields:
        if key not in allowed:
            raise ConfigError(f"{kind} {name!r} has no field {key!r}{did_you_mean(key, allowed)}")
    subject = f"{kind} {name!r}"
    values = converted(subject, cls, fields, on_command_line_before(kind))
    try:
        return cls(**values)
    except (ValueError, TypeError, ArithmeticError) as err:  # a plain check in __post_init__
        raise ConfigError(f"{subject}: {err}") from err


@cache
def class_of(comp: Component) -> type:
    """Return the class of a component, imported if necessary, after checking its contract.

    Raises
    ------
    PluginError : the class cannot be imported, or is no frozen dataclass whose fields have
        defaults.
    """
    try:
        cls = comp.cls
    except (Exception, SystemExit) as err:  # the code of a third party may raise anything
        raise PluginError(
            f"{comp.kind}/{comp.name} of package {comp.package!r} did not load "
            f"({comp.target}: {_said(err)})"
        ) from err
    _check_class(comp, cls)
    return cls


def on_command_line_before(kind: str) -> str:
    """Return the prefix of a field's name on the command line."""
    return f"{kind}.NAME." if kind in KEYED else f"{kind}."


def build_from_config(kind: str, config: Mapping[str, Any] | DictConfig) -> Any:
    """Make the component that a composed config node names by its key `name`."""
    from omegaconf import OmegaConf

    if OmegaConf.is_config(config):
        node = OmegaConf.to_container(config, resolve=True)
    else:
        node = config
    params = {str(key): value for key, value in node.items()} if isinstance(node, Mapping) else {}
    if "name" not in params:
        raise ConfigError(
            f"a {kind} in the config has no name; choose one: {kind}=<name>, or"
            f" {kind}@TABLE.KEY=<name> for an entry of a table (flare, metric, cameras, versions),"
            " for example metric@metric.ssim=ssim_pu21"
        )
    return build(kind, params.pop("name"), **params)


def package_of(entry: metadata.EntryPoint) -> str:
    """Return the distribution of an entry point."""
    return entry.dist.name if entry.dist else entry.value


def package_of_component(comp: Component) -> str:
    """Return the import package of a component."""
    return comp.package


def _package_name(plugin: object) -> str:
    return str(getattr(plugin, "__name__", type(plugin).__module__)).split(".")[0]


def _why_not_typed(comp: Component) -> str:
    """Return why the name of a component cannot be typed on the command line; "" if it can."""
    if not NAME.fullmatch(comp.name):
        return (
            f"a {comp.kind} has the name {comp.name!r}; expected letters, digits, '_', '-' and '.'"
            f" alone, for example acme_{comp.kind}"
        )
    if reads_as_value(comp.name):
        return (
            f"a {comp.kind} has the name {comp.name!r}, which the command line reads as a value;"
            f" expected another name, for example acme_{comp.kind}"
        )
    return ""


def _check(comp: object) -> None:
    if not isinstance(comp, Component):
        raise PluginError(
            f"isethdr_components() returned {comp!r}; expected isethdr_core.Component(kind, name,"
            " cls)"
        )
    if comp.kind not in KINDS:
        raise PluginError(f"{comp.kind}/{comp.name}: unknown kind{did_you_mean(comp.kind, KINDS)}")
    if not (isinstance(comp.name, str) and comp.name):
        raise PluginError(f"a {comp.kind} has the name {comp.name!r}; expected a text to type")
    if isinstance(comp.target, type):
        class_of(comp)
    elif not (isinstance(comp.target, str) and PLACE.fullmatch(comp.target)):
        raise PluginError(
            f"{comp.kind}/{comp.name}: {comp.target!r} is no class; "
            'expected a class or "package.module:Class"'
        )


def reads_as_value(name: str) -> bool:
    """Return whether the command line would read a name as a number, true, false or null."""
    return name.lower() in VALUE_WORDS or NUMBER.fullmatch(name) is not None


def _check_class(comp: Component, cls: type) -> None:
    if not (dataclasses.is_dataclass(cls) and _is_frozen(cls)):
        raise PluginError(
            f"{comp.kind}/{comp.name}: {cls.__qualname__} must be a frozen dataclass; "
            "write @dataclass(frozen=True) above it"
        )
    missing = [
        f.name
        for f in dataclasses.fields(cls)
        if f.init and f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise PluginError(
            f"{comp.kind}/{comp.name}: field {missing[0]!r} has no default; every field needs one"
        )
    for f in dataclasses.fields(cls):
        if f.init and f.name in TAKEN:
            raise PluginError(
                f"{comp.kind}/{comp.name}: a field is called {f.name!r}, a key that the config"
                f" needs for {TAKEN[f.name]}; give the field another name, for example"
                f" {comp.kind}_{f.name}"
            )
    abilities.check(comp.kind, comp.name, cls)


def _is_frozen(cls: type) -> bool:
    """Return whether a dataclass is frozen. The module dataclasses has no public name for this."""
    dataclass_type: Any = cls
    return bool(dataclass_type.__dataclass_params__.frozen)


def _refuse_newer(version: object) -> None:
    """Refuse a plugin that needs a newer core than this one."""
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise PluginError(
            f"{API_ASKED} is {version!r}; expected a whole number from 1 to {PLUGIN_API}"
        )
    if version > PLUGIN_API:
        raise PluginError(
            f"it needs plugin API {version}, this isethdr has {PLUGIN_API}; "
            "install a newer isethdr, or an older version of the plugin"
        )


def _newer_by_source(entry: metadata.EntryPoint) -> str:
    """Return a message if the source of a plugin declares that it needs a newer core; otherwise an
    empty text.

    Such a plugin often fails on a missing import before its declaration can be read.
    """
    try:
        spec = util.find_spec(entry.module)
        source = Path(spec.origin).read_text() if spec and spec.origin else ""
        for node in ast.parse(source).body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == API_ASKED:
                _refuse_newer(ast.literal_eval(node.value))
    except PluginError as err:
        return f"PluginError: {err}"
    except (Exception, SystemExit):  # noqa: BLE001 - why the plugin failed is known already
        return ""
    return ""


def _refuse_unknown_hooks(pm: pluggy.PluginManager, name: str, plugin: object) -> None:
    """Refuse a misspelt hook, which would never be called. The error names the nearest hook."""
    hook_names = {n for n in vars(hookspecs) if n.startswith("isethdr_")}
    for attribute in dir(plugin):
        if (
            attribute.startswith("isethdr_")
            and hasattr(getattr(plugin, attribute), "isethdr_impl")
            and attribute not in hook_names
        ):
            raise PluginError(
                f"plugin {name!r} implements the unknown hook"
                f" {attribute!r}{did_you_mean(attribute, hook_names)}"
            )
