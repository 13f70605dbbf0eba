"""The shortcuts through Hydra change no config and no mode."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from hydra._internal import defaults_list
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.types import RunMode
from omegaconf import OmegaConf

from isethdr_core.config import hydra_shortcuts, kept_choices
from isethdr_core.config.composition import register_with_hydra


def composed(lines):
    """Return a config and its choices as Hydra composes them."""
    whole = kept_choices._by_hydra(OverridesParser.create().parse_overrides(lines), "config")
    return OmegaConf.to_yaml(whole.config), whole.choices


def test_a_config_is_the_same_with_and_without_the_shortcut(monkeypatch, tmp_path):
    """The defaults list of one file depends on a choice that was typed."""
    register_with_hydra()
    assert defaults_list._create_interpolation_map is hydra_shortcuts._table_if_needed
    for name, text in {
        "own/first": "defaults: [{/detail@detail: '${own}_seen'}]\n",
        "detail/first_seen": "sharp: true\n",
    }.items():
        file = tmp_path / "conf" / f"{name}.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.chdir(tmp_path)
    overrides = ["experiment=night_drive", "+own=first", "lens=wavefront"]
    short = composed(overrides)
    assert "sharp: true" in short[0]
    table = hydra_shortcuts._table_of_choices
    monkeypatch.setattr(defaults_list, "_create_interpolation_map", table)
    assert composed(overrides) == short


@pytest.fixture
def asked(monkeypatch):
    """Return a function that tells whether the mode of a command is taken from Hydra's config."""
    monkeypatch.setattr(hydra_shortcuts, "_mode_of_config", lambda *_: RunMode.MULTIRUN)

    def ask(*overrides, entry="pkg://hydra.conf"):
        path = SimpleNamespace(get_path=lambda: [SimpleNamespace(path=entry)])
        hydra = SimpleNamespace(config_loader=SimpleNamespace(get_search_path=lambda: path))
        mode = hydra_shortcuts._mode_if_set(hydra, "config", overrides)
        assert mode in (None, RunMode.MULTIRUN)
        return mode is not None

    return ask


def test_hydra_is_asked_where_something_may_set_the_mode(asked, monkeypatch, tmp_path):
    assert not asked("scene=tunnel", "seed=1", "hydra.sweep.dir='/there'")
    assert asked("seed=1", "hydra.mode=MULTIRUN")
    assert asked("++hydra.searchpath=[pkg://acme.conf]")
    assert asked("seed=1", entry="file:///own/conf")
    preset = tmp_path / "experiment" / "mine.yaml"
    preset.parent.mkdir()
    monkeypatch.setattr(hydra_shortcuts, "preset_folders", lambda: [tmp_path])
    for text, sets_it in (("model: 1\n", False), ("hydra:\n  mode: MULTIRUN\n", True)):
        preset.write_text(text)
        hydra_shortcuts.is_in_a_preset.cache_clear()
        assert asked("experiment=mine") == sets_it
    hydra_shortcuts.is_in_a_preset.cache_clear()


def test_a_preset_that_cannot_be_read_sets_no_mode(asked, monkeypatch, tmp_path):
    monkeypatch.setattr(hydra_shortcuts, "preset_folders", lambda: [tmp_path])
    (tmp_path / "grey.yaml").write_bytes("# f\xfcr nachts\n".encode("latin-1"))
    (tmp_path / ".#mine.yaml").symlink_to("somebody@somewhere")
    hydra_shortcuts.is_in_a_preset.cache_clear()
    assert not asked("experiment=grey")
    hydra_shortcuts.is_in_a_preset.cache_clear()
