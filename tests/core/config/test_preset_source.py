"""The source of presets serves what Hydra's own source serves."""

from __future__ import annotations

import os

import pytest
from hydra._internal.core_plugins.importlib_resources_config_source import (
    ImportlibResourcesConfigSource,
)
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigLoadError
from omegaconf import OmegaConf

from isethdr_core.config import preset_source
from isethdr_core.config.preset_source import PACKAGE, SCHEME, PresetSource, served

CORE = "isethdr_core.config.conf"


@pytest.mark.parametrize("package", [CORE, "hydra.conf"])
def test_what_is_served_is_what_hydra_serves(package):
    ours = PresetSource("isethdr", f"{SCHEME}://{package}")
    theirs = ImportlibResourcesConfigSource("isethdr", f"{PACKAGE}{package}")
    assert ours.available() and theirs.available()
    groups = [name for name in ours.list("", ObjectType.GROUP) if name != "__pycache__"]
    assert groups
    for group in groups:
        for kind in (ObjectType.CONFIG, ObjectType.GROUP, None):
            assert ours.list(group, kind) == theirs.list(group, kind)
        for name in ours.list(group, ObjectType.CONFIG)[:3]:
            path = f"{group}/{name}"
            mine = ours.load_config(path)
            other = theirs.load_config(path)
            assert OmegaConf.to_yaml(mine.config) == OmegaConf.to_yaml(other.config)
            assert (mine.header, mine.provider) == (other.header, other.provider)
            for source in (ours, theirs):
                assert source.is_config(path) and not source.is_group(path)
    for source in (ours, theirs):
        assert not source.is_config("lighting/no_such") and not source.is_group("no_such")
        with pytest.raises(ConfigLoadError, match=r"not found.*no_such\.yaml"):
            source.load_config("lighting/no_such")


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return the source of a new package with one preset, and the preset's file."""
    (tmp_path / "one_preset_only" / "sensor").mkdir(parents=True)
    (tmp_path / "one_preset_only" / "__init__.py").touch()
    file = tmp_path / "one_preset_only" / "sensor" / "mine.yaml"
    file.write_text("# @package _global_\na: 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    preset_source._folder.cache_clear()
    return PresetSource("acme", served("pkg://one_preset_only")), file


def test_each_caller_has_a_config_of_its_own(package):
    source, _ = package
    first = source.load_config("sensor/mine")
    first.config.a = 7
    first.header["package"] = "other"
    second = source.load_config("sensor/mine")
    assert (second.config.a, second.header["package"]) == (1, "_global_")


def test_a_changed_file_is_read_again(package):
    source, file = package
    assert source.load_config("sensor/mine").config.a == 1
    written = file.stat()
    file.write_text("# @package _global_\na: 22\n")
    assert source.load_config("sensor/mine").config.a == 22
    file.write_text("# @package _global_\na: 33\n")
    os.utime(file, ns=(written.st_atime_ns, written.st_mtime_ns + 10**9))
    assert source.load_config("sensor/mine").config.a == 33


@pytest.mark.parametrize("path", ["pkg://no.such.package", "pkg://yaml.error", "file:///conf"])
def test_what_has_no_folder_is_left_to_hydra(path):
    assert served(path) == path
