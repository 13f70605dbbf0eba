"""Feed the registry to Hydra: dataclass fields become typed config groups, presets join the search
path.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from contextlib import contextmanager
from dataclasses import MISSING, Field, field, fields, make_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin, get_type_hints

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.core.plugins import Plugins
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import MISSING as UNSET
from omegaconf import FloatNode, IntegerNode, OmegaConf, open_dict
from omegaconf.errors import (
    ConfigAttributeError,
    ConfigKeyError,
    KeyValidationError,
    OmegaConfBaseException,
    ValidationError,
)

from ..errors import ConfigError, IsetHdrError, PluginError, did_you_mean
from ..plugins.component import KEYED, KINDS, Component
from ..plugins.config_paths import config_paths
from ..plugins.presets import EXPERIMENT
from ..plugins.registry import class_of, components
from .hydra_shortcuts import take_shortcuts
from .kept_choices import CONFIG_MODULE, composed
from .preset_source import PresetSource, served
from .trust import check_overrides, own_folder
from .typed_text import with_texts

if TYPE_CHECKING:
    from omegaconf import DictConfig

REQUIRED = ("scene", "lighting", "lens", "isp")  # a run has one component of each of these kinds
TABLES = {"cameras": "sensor", "flare": "flare", "metric": "metric", "versions": "lighting"}
LAUNCHER = "hydra/launcher"
# {launcher of another package: extra that installs it}
EXTRAS = {"joblib": "sweep", "submitit_slurm": "slurm", "submitit_local": "slurm", "ray": "ray"}
NO_JSON = (bytes, complex, Enum, Set)  # types whose values have no place in the name of a run
NOT_THERE = re.compile(r"Could not delete (?:from config\. )?'([^']+)'")


def compose(overrides: Sequence[str] = (), config_name: str = "config") -> DictConfig:
    """Return the composed config, the same as the command line's `isethdr run <overrides>`.

    Parameters
    ----------
    overrides : list of Hydra overrides, e.g. `["experiment=night_drive", "sensor=rgbw",
        "sensor.exposure_s=0.008"]`.

    Raises
    ------
    ConfigError : an unknown group, name or key, or text in place of a number. Other values and
        ranges are checked when the components are built, for example by `run`.
    """
    register_with_hydra()
    with user_mistakes():
        parsed = OverridesParser.create().parse_overrides(with_texts(overrides))
        check_overrides(parsed)
        check_choices(parsed)
        result = composed(parsed, config_name)
        return resolved(with_choices(result.config, result.choices))


def check_choices(overrides: Iterable[Override]) -> None:
    """Refuse a choice that is not a name, one without its entry in a table, and a run without a
    kind that it needs. Hydra fails on them without a helpful message.

    Parameters
    ----------
    overrides : parsed.

    Raises
    ------
    ConfigError : `null` or an interpolation stands where the name of a config is expected, a kind
        that a run needs is left out, or a choice names no entry of a table.
    """
    for override in overrides:
        group = override.key_or_group.partition("@")[0]
        value = override.value()
        changes = not (override.is_add() or override.is_delete())
        if (
            changes
            and group in TABLES
            and group not in KEYED
            and not isinstance(value, dict | None)
        ):
            kind = TABLES[group]
            single = "sensor=<name> for a single camera, " if kind == "sensor" else ""
            raise ConfigError(
                f"{override.input_line} names no entry of the table {group}; type {single}"
                f"~{group}.KEY to leave one out, {kind}@{group}.KEY=<name> to replace one, or"
                f" +{kind}@{group}.KEY=<name> to add one; `isethdr run --cfg job` shows all"
            )
        if group not in (*KINDS, EXPERIMENT):
            continue
        name = override.get_key_element().lstrip("+~")
        if group in KEYED and override.package is None and not isinstance(value, dict):
            raise ConfigError(
                f"{override.input_line} names no entry of the table {group}; type"
                f" ~{group}.KEY to leave one out, {group}@{group}.KEY=<name> to replace one, or"
                f" +{group}@{group}.KEY=<name> to add one; `isethdr run --cfg job` shows all"
            )
        if name in REQUIRED and override.is_delete():
            raise ConfigError(
                f"~{name} leaves out the {name}, and each run needs one; type for example"
                f" {name}=ideal"
            )
        if value is None and not override.is_delete():
            leave_out = "" if name in REQUIRED else f"~{name} to leave it out, or "
            raise ConfigError(f"{name} is null; expected a name; type {leave_out}{name}=<name>")
        if "${" in str(value):
            raise ConfigError(
                f"{group} is {str(value)!r}; expected a name; type {group}=<name>;"
                " `isethdr plugins` lists the names"
            )


@contextmanager
def user_mistakes() -> Iterator[None]:
    """Turn what Hydra and OmegaConf raise about a config into ConfigError.

    Hydra 1.3 does not check some values, so any error may follow from them: ValueError for
    `renderer=null`, TypeError for `scene=[1]`, AssertionError for `+lighting=${seed}`.
    """
    try:
        yield
    except OverrideParseException as err:
        raise ConfigError(
            f"the override {err.override!r} cannot be read; expected key=value; put quotes around"
            " text with any character other than English letters, digits, spaces and _ - + . / : %,"
            " for example \"scene.path='/data/a=b.exr'\""
        ) from None
    except (HydraException, OmegaConfBaseException) as err:
        raise ConfigError(explain(err)) from None
    except IsetHdrError:
        raise
    except Exception as err:
        advice = (
            "; expected <kind>=<name>; type ~<kind>, for example ~renderer, to leave one out"
            if isinstance(err, TypeError | AssertionError)  # other errors are not about a choice
            else ""
        )
        said = " ".join(str(err).split()) or type(err).__name__
        raise ConfigError(f"the config cannot be composed: {said}{advice}") from None


def resolved(config: DictConfig) -> DictConfig:
    """Return the config once every `${...}` in it has been resolved.

    Raises
    ------
    ConfigError : an interpolation names a key, a variable or a resolver that does not exist.
    """
    try:
        OmegaConf.to_container(config, resolve=True)
    except OmegaConfBaseException as err:
        where = err.full_key or "a value"
        raise ConfigError(
            f"{where} cannot be resolved: {str(err.msg or err).splitlines()[0]}; expected a value,"
            " or ${key} of a key that the config has; type for example"
            f" {err.full_key or 'key'}=<value>"
        ) from None
    return config


def with_choices(config: DictConfig, choices: DictConfig) -> DictConfig:
    """Return the config without Hydra's node. Its new key `choices` holds the names of the chosen
    presets by group, for people to read.
    """
    chosen = OmegaConf.to_container(choices)
    assert isinstance(chosen, dict)
    with open_dict(config):
        config.pop("hydra", None)
        config.choices = {k: v for k, v in chosen.items() if v and not str(k).startswith("hydra")}
    return config


def explain(err: BaseException) -> str:
    """Return the message of Hydra or OmegaConf in the form of isethdr's errors: what was wrong, the
    nearest valid name, what to type.
    """
    if isinstance(err, MissingConfigException) and "/" in str(err.missing_cfg_file):
        group, _, name = str(err.missing_cfg_file).rpartition("/")
        options = [o for o in err.options or () if not o.startswith("_")]
        hint = did_you_mean(name, options) if options else ""
        if group == LAUNCHER:
            install = f"; type pip install 'isethdr[{EXTRAS[name]}]'" if name in EXTRAS else hint
            return f"{group} {name!r} is not installed{install}"
        if group.startswith("hydra/"):
            return f"{group} {name!r} is not installed{hint}"
        lists = "isethdr run --help" if group == EXPERIMENT else "isethdr plugins"
        return f"{group} {name!r} is not installed{hint}; `{lists}` describes all of them"
    # Hydra wraps what OmegaConf raises about an override
    for missing in (err, err.__cause__):
        if isinstance(missing, ConfigAttributeError | ConfigKeyError):
            return _no_such_key(missing, overridden=missing is not err, text=str(err))
        if isinstance(missing, KeyValidationError):
            return _wrong_key(missing)
        if isinstance(missing, ValidationError) and isinstance(
            missing.child_node, IntegerNode | FloatNode
        ):
            whole = isinstance(missing.child_node, IntegerNode)
            value = "null" if missing.value is None else str(missing.value)
            return (
                f"{missing.full_key} is {value!r}; expected a"
                f"{' whole' * whole} number; type for example {missing.full_key}="
                f"{'1' if whole else '0.5'}"
            )
    text = " ".join(str(e).strip() for e in (err, err.__cause__) if e is not None)
    if absent := NOT_THERE.search(text):
        return (
            f"{absent.group(1)} cannot be left out, because the config does not have it; type"
            " isethdr run --cfg job to see all keys"
        )
    lines = [
        line.strip()
        for line in text.splitlines()
        if line.strip() and not line.strip().startswith("object_type")
    ]
    return "; ".join(lines)


def _wrong_key(missing: Any) -> str:
    """Return the complaint about a key whose type is not that of a table's keys.

    Parameters
    ----------
    missing : OmegaConf's KeyValidationError. Its fields decide the message.
    """
    key = missing.key
    # a key with a dot in it looks like two keys in `full_key`
    table = str(missing.full_key).removesuffix(f".{key}")
    if missing.parent_node is not None and missing.parent_node._metadata.key_type is str:
        return (
            f"{table} cannot have the key {key}: its keys are texts, and {key} is read as a number"
            f" or a truth value; type +{table}.{key}=<value>, which reads it as a text"
        )
    number = key if str(key).isdigit() else 4  # a table by number, as of Zernike terms
    return (
        f"{missing.full_key} cannot be set: the keys of {table} are whole numbers; expected"
        f" the table; type for example '+{table}={{{number}:<value>}}'"
    )


def _no_such_key(missing: Any, overridden: bool, text: str) -> str:
    """Return the complaint about a key that a config lacks.

    Parameters
    ----------
    missing : OmegaConf's error. Its fields decide the message.
    overridden : whether an override names the key.
    text : Hydra's message, the only one that quotes the override.
    """
    key = str(missing.key)
    owner = missing.object_type
    quoted = re.search(r"override '([^']+)'", text)
    where = quoted.group(1) if overridden and quoted else key
    if overridden and owner is dict and key in KINDS:
        cameras = list(missing.parent_node.get("cameras") or {}) if key == "sensor" else []
        of_camera = f", or cameras.{cameras[0]}{where[len(key) :]}=<value>" if cameras else ""
        return f"{where} sets a field, but no {key} is chosen; type {key}=<name> as well{of_camera}"
    table, _, entry = str(missing.full_key).partition(".")
    if overridden and owner is dict and table in TABLES and entry == key:
        return (
            f"{table} has no entry {key!r}{did_you_mean(key, missing.parent_node or ())}; to add"
            f" it, type +{TABLES[table]}@{table}.{key}=<name>"
        )
    if overridden and owner is dict and "." in str(missing.full_key):  # a table that users fill
        added = re.search(r"append to your config use (.+)", text)
        typed = shlex.quote(added.group(1).strip()) if added else f"+{where}=<value>"
        return f"the config has no key {where!r}; to add it to the table type {typed}"
    keys = _keys_of(getattr(owner, "__name__", ""))
    of_component = table in KINDS and table not in KEYED
    searched = overridden and (of_component or not entry)
    elsewhere = _paths_of(missing.parent_node, key) if searched else []
    if elsewhere:
        typed = " or ".join(f"{path}=<value>" for path in elsewhere)
        return f"the config has no key {where!r}, but it has this name elsewhere; type {typed}"
    return f"the config has no key {where!r}{did_you_mean(key, keys)}"


def _paths_of(node: Any, name: str) -> list[str]:
    """Return the paths of the setting and of the fields of chosen components with this name.

    Parameters
    ----------
    node : any node of the config.
    name : name of a setting or field.
    """
    root = node._get_root() if OmegaConf.is_config(node) else {}
    chosen = [kind for kind in KINDS if kind not in KEYED and name in (root.get(kind) or {})]
    return [*([name] if name in root else []), *(f"{kind}.{name}" for kind in chosen)]


def _keys_of(schema_name: str) -> list[str]:
    for comp in components().values():
        if comp.class_name + "Config" == schema_name:
            return [f.name for f in fields(class_of(comp)) if f.init]
    return [*KINDS, "cameras", "versions", "seed", "device", "experiment", "name", "tags"]


@cache
def register_with_hydra() -> None:
    """Make components and presets known to Hydra; call once before `hydra.main` or
    `hydra.compose`.
    """
    from .component_source import ComponentSource

    Plugins.instance().register(ComponentSource)
    Plugins.instance().register(PresetSource)
    Plugins.instance().register(_search_path_plugin())
    take_shortcuts()


def schema(comp: Component) -> type:
    """Return a typed Hydra node with the component's own fields plus its registry name."""
    cls = class_of(comp)
    hints = _field_types(comp, cls)
    columns = [("name", str, field(default=comp.name))]
    for f in fields(cls):
        if not f.init:
            continue
        if f.default_factory is not MISSING:
            default = field(
                default_factory=(
                    _open(f.default_factory)
                    if _for_pydantic_alone(hints[f.name])
                    else f.default_factory
                )
            )
        else:
            default = field(default=UNSET if f.default is MISSING else f.default)
        columns.append((f.name, hydra_type(hints[f.name], f), default))
    return make_dataclass(f"{cls.__name__}Config", columns)


def _field_types(comp: Component, cls: type) -> dict[str, Any]:
    """Return the types of the fields of a component's class.

    Raises
    ------
    PluginError : a type cannot be read, or its values have no place in the name of a run.
    """
    subject = f"{comp.kind}/{comp.name} of package {comp.package!r}"
    try:
        hints = get_type_hints(cls)
    except Exception as err:  # an annotation is code of a third party
        raise PluginError(
            f"{subject}: the types of its fields cannot be read ({type(err).__name__}: {err});"
            " import the names in them at the top of the module, not under TYPE_CHECKING"
        ) from err
    for f in fields(cls):
        if f.init and _has_no_name(hints[f.name]):
            raise PluginError(
                f"{subject}: the field {f.name!r} is of the type {hints[f.name]}; expected bool,"
                " int, float, str, a Literal of names, or tuples and tables of these"
            )
    return hints


def _has_no_name(annotation: Any) -> bool:
    """Return whether a type holds bytes, complex numbers, sets, or an Enum of neither texts nor
    numbers: such values are no JSON, of which the name of a run is made.
    """
    origin = get_origin(annotation)
    if origin is Literal:
        return False
    held = origin or annotation
    if isinstance(held, type) and issubclass(held, NO_JSON):
        return not issubclass(held, str | int | float)
    return any(map(_has_no_name, get_args(annotation)))


def hydra_type(annotation: Any, f: Field[Any] | None = None) -> Any:
    """Return the annotation where OmegaConf 2.3 understands it, else `Any`.

    `Literal`, nested tuples and unions with containers are refused by OmegaConf; pydantic checks
    them when the component is built.
    """
    if _for_pydantic_alone(annotation):
        return Any
    if annotation is bool:
        return Any  # OmegaConf accepts any number as true; pydantic accepts only 0 and 1
    if annotation in (int, float, str) and f is not None and isinstance(f.default, annotation):
        # OmegaConf accepts these types; testing every field would add 0.25 s to each start
        return annotation
    default = (
        field(default_factory=f.default_factory)
        if f is not None and f.default_factory is not MISSING
        else (
            field(default=f.default)
            if f is not None and f.default is not MISSING
            else field(default="???")
        )
    )
    try:
        OmegaConf.structured(make_dataclass("Probe", [("x", annotation, default)]))
    except (OmegaConfBaseException, ValueError, TypeError):
        return Any
    return annotation


def _for_pydantic_alone(annotation: Any) -> bool:
    """Return whether a type is one that OmegaConf accepts, but whose values it refuses.

    - a table whose keys are of type float: it would accept 450.0 and refuse 450;
    - a table whose keys are a Literal: it fails on each of them;
    - a union with a table, also with None: it cannot set the table;
    - another union of two types, a tuple or a list of tables: it would refuse 1 for a float.
    """
    parts = get_args(annotation)
    origin = get_origin(annotation)
    if origin is Literal:
        return False
    if origin is dict and parts and parts[0] not in (str, int, bool):
        return True
    if origin in (Union, UnionType):
        types = [part for part in parts if part is not NoneType]
        if len(types) > 1 or any(map(_is_table, types)):
            return True
    if origin in (tuple, list) and any(map(_is_table, parts)):
        return True
    return any(map(_for_pydantic_alone, parts))


def _is_table(annotation: Any) -> bool:
    return (get_origin(annotation) or annotation) is dict


def _open(default_factory: Callable[[], Any]) -> Callable[[], Any]:
    """Return a factory of the same default. Keys may be added to it if it is a table."""

    def opened() -> Any:
        default = default_factory()
        if not isinstance(default, dict):
            return default
        return OmegaConf.create(default, flags={"struct": False})

    return opened


def _search_path_plugin() -> type:
    from .component_source import SCHEME

    class IsethdrSearchPath(SearchPathPlugin):
        """Adds the folders with presets that plugins ship."""

        def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
            # before Hydra's own sources of the same files, which parse them for each config
            search_path.prepend(provider="isethdr", path=served(f"pkg://{CONFIG_MODULE}"))
            search_path.prepend(provider="isethdr", path=served("pkg://hydra.conf"))
            for name, path in config_paths():
                search_path.append(provider=name, path=served(path))
            search_path.append(provider="isethdr", path=f"{SCHEME}://")
            if own_folder().is_dir():
                search_path.append(provider="working folder", path=f"file://{own_folder()}")

    return IsethdrSearchPath
