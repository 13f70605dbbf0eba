"""Composing configs: the defaults, choices, experiments, and mistakes with the nearest valid
name.
"""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from enum import Enum, StrEnum
from importlib.resources import files
from itertools import zip_longest
from typing import Dict, Literal  # noqa: UP035

import numpy as np
import pytest
from hydra.core.object_type import ObjectType
from hydra.errors import MissingConfigException

from isethdr_core import Component, build, compose
from isethdr_core.component import KINDS
from isethdr_core.config.component_source import SCHEME, ComponentSource
from isethdr_core.config.composition import explain, register_with_hydra, schema
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.pipeline.chain import chain
from isethdr_core.plugins.registry import build_from_config, components, plugin_manager
from isethdr_core.store import write_store


def presets():
    """Return (kind, name) of every preset that a plugin or the core ships."""
    packages = {"isethdr_core.config.conf"}
    for impl in plugin_manager().hook.isethdr_config_paths.get_hookimpls():
        packages |= {path.removeprefix("pkg://") for path in impl.function()}
    return sorted(
        {
            (folder.name, file.name.removesuffix(".yaml"))
            for package in packages
            for folder in files(package).iterdir()
            if folder.is_dir()
            for file in folder.iterdir()
            if file.name.endswith(".yaml")
        }
    )


def test_the_main_job_composes_and_builds():
    parts = chain(compose())
    assert (
        list(parts.cameras) == ["bayer", "split_pixel", "rgbw"]
        and parts.flares
        and parts.metrics
        and parts.renderer is not None
    )


# roads without lamps: a lighting that weighs streetlights is refused for them
UNLIT = {"scene=street_country", "scene=street_motorway", "scene=night_drive_rural"}


# config keys that choose presets of a kind; several where a run takes several of the kind
PLACES = {
    "flare": ["flare@flare.dirt", "+flare@flare.more"],
    "metric": ["metric@metric.snr"],
    "sensor": ["sensor@cameras.bayer", "sensor@cameras.rgbw", "sensor@cameras.split_pixel"],
    "lighting": ["lighting", "lighting@versions.day", "+lighting@versions.more"],
}


def turns():
    """Return lists of overrides that together choose every preset.

    Each list chooses presets of many kinds, because composing takes a fifth of a second.
    Experiments and roads without lamps have lists of their own.
    """
    of_kind = {}
    for kind, name in presets():
        of_kind.setdefault(kind, []).append(name)
    of_kind.pop("hydra", None)
    alone = [[f"experiment={name}"] for name in of_kind.pop("experiment")]
    alone += [[scene] for scene in sorted(UNLIT)]
    of_kind["scene"] = [name for name in of_kind["scene"] if f"scene={name}" not in UNLIT]
    of_place = []
    for kind, names in of_kind.items():
        places = PLACES.get(kind, [kind])
        for k, place in enumerate(places):
            of_place.append([f"{place}={name}" for name in names[k :: len(places)]])
    return alone + [[o for o in turn if o] for turn in zip_longest(*of_place)]


@pytest.mark.parametrize("overrides", turns(), ids=" ".join)
def test_every_preset_composes_and_builds(overrides, tmp_path, isethdr_home):
    if overrides == ["experiment=own_picture"]:  # it needs a file of the user
        np.save(tmp_path / "own.npy", np.ones((9, 16)))
        overrides = [*overrides, f"scene.path={tmp_path / 'own.npy'}", "scene.unit=cd/m2"]
        overrides += ["scene.horizontal_field_deg=40"]
    if overrides == ["experiment=stored_scene"]:  # it needs a store
        light = build("scene", "uniform")()
        write_store(isethdr_home / "scenes", "abc0-1", {"": light}, {"recipe": "abc0"})
        overrides = [*overrides, "scene.store=abc0", "lighting=ideal", "~versions"]
    chain(compose(overrides))


def test_a_sensor_replaces_the_three_cameras():
    parts = chain(compose(["sensor=rgbw", "sensor.exposure_s=0.008"]))
    assert list(parts.cameras) == ["rgbw"] and parts.cameras["rgbw"].exposure_s == 0.008
    assert list(chain(compose(["~cameras.split_pixel"])).cameras) == ["bayer", "rgbw"]


def test_a_member_can_be_added_and_removed():
    config = compose(["~flare.dirt", "+metric@metric.mean=ideal", "~metric.ssim"])
    parts = chain(config)
    assert not parts.flares and "mean" in parts.metrics and "ssim" not in parts.metrics


def test_every_component_is_a_config_group_entry_with_its_name():
    source = ComponentSource(provider="isethdr", path=f"{SCHEME}://")
    for kind, name in components():
        assert source.is_config(f"{kind}/{name}") and name in source.list(kind, ObjectType.CONFIG)
        assert source.load_config(f"{kind}/{name}").config["name"] == name
    # Hydra itself finds entries in this source: choose or add the last component of each kind
    last = {kind: [n for k, n in components() if k == kind][-1] for kind in KINDS}
    group = {"flare": "+flare@flare.new", "metric": "+metric@metric.new"}
    config = compose([f"{group.get(kind, kind)}={name}" for kind, name in last.items()])
    for kind, name in last.items():
        node = config[kind]["new"] if kind in group else config[kind]
        assert node["name"] == name


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["sensor=rgwb"], "sensor 'rgwb' is not installed; did you mean 'rgbw'"),
        (["experiment=night_drve"], "'night_drve' is not installed; did you mean 'night_drive'"),
        (
            ["sensor=rgbw", "sensor.exposure=1"],
            "no key 'sensor.exposure'; did you mean 'exposure_s'",
        ),
        (["sensr=rgbw"], "no key 'sensr'; did you mean 'sensor'"),
        (["scene.width=160"], "no key 'scene.width', .* type renderer.width=<value>"),
        (["f_number=2"], "no key 'f_number', .* type lens.f_number=<value>"),
        (["metric.ssim.width=1"], "no key 'metric.ssim.width' .one of: compression, white_cd_m2"),
        (
            ["sensor=rgbw", "sensor.exposure_s=long"],
            "exposure_s is 'long'; expected a number; type",
        ),
        (
            ["renderer.width=null"],
            "renderer.width is 'null'; expected a whole number; type for example renderer.width=1",
        ),
        (["renderer=null"], "type ~renderer to leave it out, or renderer=<name>"),
        (["seed=many"], "seed is 'many'; expected a whole number"),
        (["draws=true"], "draws is True; expected a whole number of shots"),
        (["metric=null"], r"metric=null names no entry .* type ~metric.KEY to leave one out"),
        (["~metric"], "~metric names no entry of the table metric; type ~metric.KEY to leave"),
        (["+flare=haze"], r"names no entry .* or \+flare@flare.KEY=<name> to add one"),
        (["cameras=[bayer,rgbw]"], "table cameras; type sensor=<name> for a single camera, ~cam"),
        (["versions=night"], r"or \+lighting@versions.KEY=<name> to add one"),
        (["experiment=night"], "did you mean 'night_city'.*`isethdr run --help` describes all"),
        (
            ["lighting=targets", "lighting.targets.sky={statistic: max, cd_m2: 9}"],
            r"to add it to the table type '\+lighting.targets.sky={statistic: max, cd_m2: 9}'",
        ),
        (
            ["~lens"],
            "~lens leaves out the lens, and each run needs one; type for example lens=ideal",
        ),
        (["lens=null"], "lens is null; expected a name; type lens=<name>"),
        (["lighting@versions.day=null"], "type ~lighting@versions.day to leave it out, or"),
        (["~flare.fog"], "flare.fog cannot be left out, because the config does not have it"),
        (["lens=[ideal2]"], "lens 'ideal2' is not installed; `isethdr plugins`"),
        (["sensor.exposure_s=0.01"], "type sensor=<name> as well, or cameras.bayer.exposure_s=<"),
        (
            ["cameras.bayr.exposure_s=0.01"],
            r"cameras has no entry 'bayr'; did you mean 'bayer'.* \+sensor@cameras.bayr=<name>",
        ),
        (
            ["lens=wavefront", "lens.zernike_um.8=0.1"],
            r"keys of lens.zernike_um are whole numbers; .* for example '\+lens.zernike_um={8:<",
        ),
        (
            ["lens=wavefront", "lens.zernike_um={1.5:3}"],
            r"of lens.zernike_um are whole numbers; .* type for example '\+lens.zernike_um={4:<",
        ),
        (
            ["sensor=bayer", "exposures={bayer:{exposure_s:0.01}}"],
            "expected a sensor with automatic exposure; type exposures=null, or switch it on",
        ),
    ],
)
def test_mistakes_are_named_when_the_config_is_composed_or_built(overrides, message):
    with pytest.raises(ConfigError, match=message):
        chain(compose(overrides))


def test_types_that_hydra_cannot_express_are_checked_when_built():
    config = compose(["sensor=ideal", "sensor.curves=guess"])
    with pytest.raises(ConfigError, match="'ar0132at' or 'unit'"):
        chain(config)


def test_a_run_needs_a_camera():
    with pytest.raises(ConfigError, match="no camera"):
        chain(compose(["~cameras"]))


def test_composing_twice_gives_the_same_and_registers_once():
    assert compose(["sensor=rgbw"]) == compose(["sensor=rgbw"])
    register_with_hydra()
    assert register_with_hydra.cache_info().misses == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("submitit_slurm", "'submitit_slurm' is not installed; type pip install 'isethdr[slurm]'"),
        ("joblib", r"'joblib' is not installed; type pip install 'isethdr[sweep]'"),
        ("basci", "'basci' is not installed; did you mean 'basic'"),
    ],
)
def test_a_launcher_that_is_not_installed_names_the_extra(name, message):
    missing = MissingConfigException("", f"hydra/launcher/{name}", ["basic", "local_chunks"])
    said = explain(missing)
    assert message in said and "isethdr plugins" not in said


def test_text_that_hydra_cannot_read_is_put_between_quotes():
    file = ["scene=file", "~renderer", "lighting=ideal"]
    with pytest.raises(ConfigError, match="any character other than English .* \"scene.path='"):
        compose([*file, "scene.path=/data/a=b.exr"])
    assert compose([*file, "scene.path='/data/a=b.exr'"]).scene.path == "/data/a=b.exr"


@dataclass(frozen=True)
class Tables:
    """A metric with tables, and with numbers that may be texts."""

    gains: dict[Literal["R", "G"], float] = field(default_factory=lambda: {"R": 1.0})
    weights: dict[str, float] | None = None
    named: dict[str, float] = field(default_factory=dict)
    mixed: dict[str, float | str] = field(default_factory=dict)
    steps: tuple[dict[str, float], ...] = ()
    bare: Dict = field(default_factory=dict)  # noqa: UP006
    maybe: dict | None = None
    rows: tuple[dict, ...] = ()
    limit: float | str = "auto"

    def __call__(self, picture, truth, labels):
        return []


@pytest.mark.parametrize(
    ("override", "name", "value"),
    [
        ("metric.b.gains={R:2}", "gains", {"R": 2.0}),
        ("metric.b.gains.G=2", "gains", {"R": 1.0, "G": 2.0}),
        ("metric.b.weights={a:2}", "weights", {"a": 2.0}),
        ("+metric.b.weights.a=2", "weights", {"a": 2.0}),
        ("metric.b.weights=null", "weights", None),
        ("+metric.b.named.1=2", "named", {"1": 2.0}),
        ("+metric.b.mixed={a:1,b:x}", "mixed", {"a": 1.0, "b": "x"}),
        ("metric.b.steps=[{a:1}]", "steps", ({"a": 1.0},)),
        ("+metric.b.bare.a=1", "bare", {"a": 1}),
        ("metric.b.maybe={a:1}", "maybe", {"a": 1}),
        ("+metric.b.maybe.a=1", "maybe", {"a": 1}),
        ("metric.b.rows=[{a:1}]", "rows", ({"a": 1},)),
        ("metric.b.limit=1", "limit", 1.0),
    ],
)
def test_tables_and_unions_are_set_on_the_command_line(offer, override, name, value):
    offer("metric", "tables", Tables)
    config = compose(["+metric@metric.b=tables", override])
    found = getattr(build_from_config("metric", config.metric.b), name)
    assert found == value and repr(found) == repr(value)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("metric.b.gains.Q=2", "expected 'R' or 'G'; type for example metric.NAME.gains={R:1.0}"),
        ("metric.b.weights={a:x}", "weights is {'a': 'x'} with 'x' in it; expected a valid number"),
        ("+metric.b.named={1:2}", r"keys are texts, .* type \+metric.b.named.1=<value>"),
    ],
)
def test_a_wrong_entry_of_a_table_is_named(offer, override, message):
    offer("metric", "tables", Tables)
    with pytest.raises(ConfigError, match=message):
        build_from_config("metric", compose(["+metric@metric.b=tables", override]).metric.b)


class Colour(Enum):
    """A choice that is no text."""

    RED = 1


class Mode(StrEnum):
    """A choice that is a text."""

    FAST = "fast"


@pytest.mark.parametrize(
    ("field_type", "message"),
    [
        ("Missing | None", "types of its fields cannot be read .*'Missing' is not defined"),
        (Colour, "the field 'setting' is of the type .*Colour.*; expected bool, int"),
        (tuple[Colour, ...] | None, "the field 'setting' is of the type"),
        (bytes, "the field 'setting' is of the type"),
        (complex, "the field 'setting' is of the type"),
        (frozenset[str], "the field 'setting' is of the type"),
    ],
)
def test_a_field_of_a_type_without_a_place_in_a_config_is_a_broken_plugin(field_type, message):
    def call(self, picture, truth, labels):
        return []

    methods = {"__call__": call}
    made = make_dataclass("Made", [("setting", field_type, None)], frozen=True, namespace=methods)
    with pytest.raises(PluginError, match=f"metric/made of package .*: .*{message}"):
        schema(Component("metric", "made", made))
    plain = make_dataclass("Plain", [("setting", Mode, Mode.FAST)], frozen=True, namespace=methods)
    assert schema(Component("metric", "plain", plain))
