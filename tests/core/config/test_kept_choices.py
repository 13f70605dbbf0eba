"""Cached configs of choices equal those that Hydra composes. They are composed again when a preset
file or a component has changed.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf

from isethdr_core import compose
from isethdr_core.config import kept_choices
from isethdr_core.config.composition import register_with_hydra, with_choices
from isethdr_core.errors import ConfigError


@pytest.fixture
def composed_by_hydra(monkeypatch):
    """Return a list that receives the overrides of each call of Hydra."""
    calls = []
    by_hydra = kept_choices._by_hydra

    def listed(overrides, config_name):
        calls.append([o.input_line for o in overrides])
        return by_hydra(overrides, config_name)

    monkeypatch.setattr(kept_choices, "_by_hydra", listed)
    return calls


VALUES = ["lens.f_number=9", "~flare.dirt", "+scene.new={a: 1}", "tags=[b]", "draws=2", "draws=3"]
CHOICES = ["sensor=rgbw", "+metric@metric.mean=ideal"]


def test_values_are_applied_to_choices_as_by_hydra(composed_by_hydra):
    register_with_hydra()
    overrides = [VALUES[0], CHOICES[0], *VALUES[1:], CHOICES[1]]
    parsed = OverridesParser.create().parse_overrides(overrides)
    expected = kept_choices._by_hydra(parsed, "config")
    config = compose(overrides)
    assert composed_by_hydra == [overrides, CHOICES]
    whole = with_choices(expected.config, expected.choices)
    assert config == whole and OmegaConf.to_yaml(config) == OmegaConf.to_yaml(whole)


def test_choices_are_composed_once_and_each_config_is_new(composed_by_hydra):
    first = compose([*CHOICES, "seed=1"])
    first.lens.f_number = 77.0
    composed_by_hydra.clear()
    second = compose([*CHOICES, "seed=2"])
    assert not composed_by_hydra
    assert (second.seed, second.lens.f_number) == (2, compose(CHOICES).lens.f_number)
    with pytest.raises(ConfigError, match="no key 'lens.f_numbr'; did you mean 'f_number'"):
        compose([*CHOICES, "lens.f_numbr=2"])


@pytest.mark.parametrize("override", ["lens={f_number: 3.0}", "hydra.job.name=x"])
def test_hydra_gets_everything_where_it_may_decide_otherwise(composed_by_hydra, override):
    overrides = ["lens.f_number=2.0", override]
    config = compose(overrides)
    assert composed_by_hydra == [overrides]
    assert config.lens.f_number == (3.0 if "{" in override else 2.0)


def test_a_changed_file_and_another_component_are_seen(
    composed_by_hydra, monkeypatch, tmp_path, offer
):
    preset = tmp_path / "sensor" / "mine.yaml"
    preset.parent.mkdir()
    preset.write_text("a: 1\n")
    monkeypatch.setattr(kept_choices, "preset_folders", lambda: [tmp_path])
    monkeypatch.setattr(
        kept_choices, "_by_hydra", lambda *_: SimpleNamespace(config={}, choices=len(calls))
    )
    calls = []

    def made_anew():
        kept = kept_choices.composed([], "config").choices
        calls.append(kept)
        return calls.index(kept) == len(calls) - 1

    assert made_anew() and not made_anew()
    preset.write_text("a: 22\n")
    assert made_anew() and not made_anew()
    (preset.parent / "other.yaml").write_text("a: 1\n")
    assert made_anew() and not made_anew()

    @dataclass(frozen=True)
    class Other:
        def __call__(self, picture, truth, labels):
            return []

    offer("metric", "quite_another", Other)
    assert made_anew() and not made_anew()


def test_files_of_the_working_folder_are_read_each_time(composed_by_hydra, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "conf" / "lens" / "mine.yaml"
    own.parent.mkdir(parents=True)
    for f_number in (3.0, 5.0):
        own.write_text(f"defaults: [wavefront]\nf_number: {f_number}\n")
        assert compose(["lens=mine"]).lens.f_number == f_number
    assert composed_by_hydra == [["lens=mine"]] * 2


def test_a_link_to_nothing_among_the_presets_is_no_source(monkeypatch, tmp_path):
    """Emacs makes such a link, `.#mine.yaml`, beside a file with unsaved changes."""
    monkeypatch.setattr(kept_choices, "preset_folders", lambda: [tmp_path])
    before = list(kept_choices._sources())
    (tmp_path / ".#mine.yaml").symlink_to("somebody@somewhere")
    assert list(kept_choices._sources()) == before
