"""Settings, length and files of trainings, tested without PyTorch."""

from __future__ import annotations

import errno
import importlib.util
import signal
import sys
from pathlib import Path

import pytest
import yaml
from isethdr_workflows.training.card import card_markdown, card_yaml, write_card
from isethdr_workflows.training.clock import Clock, Length
from isethdr_workflows.training.curves import write_curves
from isethdr_workflows.training.detector.action import train_detector
from isethdr_workflows.training.files import write_file
from isethdr_workflows.training.interrupts import between_steps
from isethdr_workflows.training.picture.settings import Settings, parsed

from isethdr_core.cli.commands import main
from isethdr_core.errors import CatalogError, ConfigError


def test_settings_are_typed_as_keys_and_other_keys_compose_the_config():
    settings, overrides = parsed(["sensor=typical_bayer", "size=large", "steps=10", "rate=1e-3"])
    assert settings == Settings(size="large", steps=10, rate=1e-3)
    assert overrides == ["sensor=typical_bayer"]
    assert parsed([])[0].minutes == 30, "a training without a length has one"
    assert parsed(["~flare.dirt"])[1] == ["~flare.dirt"]


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("size=tiny", "size is 'tiny'.*large, small.*type for example size=small"),
        ("network=unets", "did you mean 'unet'"),
        ("minutes=soon", "minutes is 'soon'; expected a number"),
        ("minutes=-3", "minutes is -3.0; expected a number above 0"),
        ("minutes=nan", "minutes is nan"),
        ("steps=1e3", "steps is '1e3'; expected a whole number"),
        ("pictures=1", "pictures is 1; expected at least 2"),
        ("batch=5", "batch is 5; expected a number that divides 16; type for example batch=4"),
        ("patch_px=100", "expected a multiple of 16; type for example patch_px=96"),
        ("patch_px=256", "not larger than a picture; type for example picture_px=256"),
        ("picture_px=96", "not larger than a picture; type for example picture_px=192"),
        ("name=../up", "expected letters"),
        ("dataset", "type key=value"),
    ],
)
def test_a_mistake_in_a_setting_is_one_clear_error(typed, message):
    with pytest.raises(ConfigError, match=message):
        parsed([typed])


def test_without_pytorch_the_command_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "torch", None)
    for name in [n for n in sys.modules if n.startswith("isethdr_workflows.training")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "argv", ["isethdr", "train", "picture", "steps=1"])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2 and said.count("\n") == 1, said
    assert "type pip install 'isethdr[train]'" in said


def test_a_detector_is_not_trained_without_the_library_of_its_scores(monkeypatch):
    monkeypatch.setitem(sys.modules, "hotcoco", None)
    with pytest.raises(ConfigError, match=r"needs hotcoco.*type pip install 'isethdr\[detect\]'"):
        train_detector(["dataset=streets", "steps=1"])


def test_the_rate_rises_and_falls_and_a_restart_counts_the_time_before():
    clock = Clock(Length(steps=1000))
    rates = []
    for clock.step in range(1000):
        rates.append(clock.rate_factor())
    assert max(rates) > 0.9 and rates[0] < 0.02 and rates[-1] < 0.03
    top = rates.index(max(rates))
    assert all(a < b for a, b in zip(rates[:top], rates[1 : top + 1]))
    assert all(a > b for a, b in zip(rates[top:], rates[top + 1 :]))
    again = Clock(Length(minutes=2), step=7, seconds_before=60.0)
    assert 0.5 <= again.share() < 0.51
    with pytest.raises(ConfigError, match="expected one of them"):
        Length(minutes=1, steps=1)


def test_a_full_disk_keeps_the_old_file_and_is_one_error(tmp_path, monkeypatch):
    path = tmp_path / "state.pt"
    write_file(path, [b"old"])
    replace = Path.replace

    def full(self, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(CatalogError, match="No space left.*make room and type the same"):
        write_file(path, [b"new"])
    monkeypatch.setattr(Path, "replace", replace)
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_error_where_curves_and_cards_are_written(tmp_path, monkeypatch):
    def full(file):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(CatalogError, match="No space left.*make room"):
        write_curves(tmp_path, [{"step": 1, "loss": 2.0}], {"loss": "loss"})
    with pytest.raises(CatalogError, match="No space left.*make room"):
        write_card(tmp_path, "a card", {"purpose": "pictures"})


def test_ctrl_c_that_is_ignored_stays_ignored(interrupts):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with between_steps() as stop_if_typed:
        signal.raise_signal(signal.SIGINT)
        stop_if_typed()
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN


def test_ctrl_c_takes_effect_between_two_steps(interrupts):
    done = []
    with pytest.raises(KeyboardInterrupt), between_steps() as stop_if_typed:
        for step in range(3):
            if step == 1:
                signal.raise_signal(signal.SIGINT)
            done.append(step)
            stop_if_typed()
    assert done == [0, 1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_card_is_the_same_in_both_forms():
    sections = {
        "effort": {"hours": 0.5, "hardware": "CPU"},
        "held_out": [{"lux": 0.01, "stated_over_true": 1.04}],
        "not_done": ["dirt"],
        "purpose": "pictures",
    }
    assert yaml.safe_load(card_yaml("a card", sections)) == {"title": "a card", **sections}
    text = card_markdown("a card", sections)
    for line in ("# a card", "## Held out", "| 0.01 | 1.04 |", "- hours: 0.5", "- dirt"):
        assert line in text.splitlines()


def test_nothing_else_imports_pytorch():
    for module in ("command", "picture.action", "picture.sources", "picture.sheets"):
        spec = importlib.util.find_spec(f"isethdr_workflows.training.{module}")
        text = Path(spec.origin).read_text()
        assert "torch_library" not in text, module
