"""The descriptions of `isethdr plugins` are cached until a file changes; those of broken classes
are never cached.
"""

from __future__ import annotations

import json
import os
import sys

import pytest

from isethdr_core.plugins import descriptions as d
from isethdr_core.plugins import presets
from isethdr_core.plugins.component import Component

SOURCE = '''
"""A package of one module."""
from dataclasses import dataclass
@dataclass(frozen=True)
class Acme:
    """{summary}"""
    gain_db: float = 3.0  # gain before the converter
    def __call__(self, light, generator):
        return light
'''


@pytest.fixture
def acme(tmp_path, monkeypatch):
    """Return a function that writes a package, and registers its class by its import path."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(summary: str) -> Component:
        file = tmp_path / "acme_described.py"
        file.write_text(SOURCE.format(summary=summary))
        os.utime(file, ns=(1, len(summary)))
        forget()
        return Component("sensor", "acme", "acme_described:Acme")

    yield write
    forget()


def forget() -> None:
    """Forget the module and the caches, as a new process has none."""
    sys.modules.pop("acme_described", None)
    d._state.cache_clear()
    d.class_of.cache_clear()


def test_a_kept_description_imports_nothing(acme):
    comp = acme("As it was.")
    first, broken = d.descriptions([comp])
    [row] = first[comp].fields
    assert first[comp].summary == "As it was." and not broken
    assert (row.name, row.default, row.unit) == ("gain_db", "3.0", "1")
    assert row.meaning == "gain before the converter" and row.origin == "acme_described:Acme"
    forget()
    again, _ = d.descriptions([Component("sensor", "acme", "acme_described:Acme")])
    assert again == first and "acme_described" not in sys.modules


def test_a_changed_file_is_described_anew(acme):
    d.descriptions([acme("As it was.")])
    comp = acme("As it is now.")
    assert d.descriptions([comp])[0][comp].summary == "As it is now."


def test_a_damaged_file_is_made_anew(acme):
    comp = acme("As it was.")
    d.cache_file().parent.mkdir(parents=True)
    for text in ("{", "[]", json.dumps({"x": 1}), json.dumps({"x": {"summary": ""}})):
        d.cache_file().write_text(text)
        assert d.descriptions([comp])[0][comp].summary == "As it was."


def test_what_does_not_load_is_said_with_its_package():
    lost = Component("lens", "lost", "acme_lost.lenses:Lost")
    found, [broken] = d.descriptions([lost])
    assert not found and broken.package == "acme_lost" and broken.entry_point == "lens/lost"
    assert "acme_lost.lenses:Lost: ModuleNotFoundError" in broken.reason
    assert not d.cache_file().exists()


def test_a_preset_in_another_encoding_does_not_hide_the_others(tmp_path, monkeypatch):
    (tmp_path / "conf" / "sensor").mkdir(parents=True)
    text = "# Gerät\ndefaults: [ideal]\npitch_um: 3.0\n".encode("latin-1")
    (tmp_path / "conf" / "sensor" / "mine.yaml").write_bytes(text)
    monkeypatch.chdir(tmp_path)
    found = presets.presets.__wrapped__("sensor")
    assert found["mine"].fields == (("pitch_um", "3.0"),) and len(found) > 1
