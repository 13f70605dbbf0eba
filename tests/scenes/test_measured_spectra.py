"""Measured spectra: the file on disk holds the tables of colour-science, and a damaged file is
replaced.
"""

import json

import numpy as np
import pytest

pytest.importorskip("colour")

from isethdr_scenes import measured_spectra
from isethdr_scenes.measured_spectra import TABLES, WAVELENGTH_NM, measured


@pytest.fixture
def looked_up(tmp_path, monkeypatch):
    """Set an empty home; return a list with one entry per look-up, and the tables themselves."""
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "home"))
    calls = []
    found = measured_spectra._from_colour_science()
    monkeypatch.setattr(measured_spectra, "_from_colour_science", lambda: calls.append(1) or found)
    return calls, found


def kept(tmp_path):
    (path,) = (tmp_path / "home" / "spectra").iterdir()
    return path


def test_the_second_time_is_read_and_the_same_to_the_last_bit(tmp_path, looked_up):
    calls, found = looked_up
    for _ in range(2):
        for name in TABLES:
            np.testing.assert_array_equal(measured(name), found[name])
    assert len(calls) == 1 and kept(tmp_path).suffix == ".json"


@pytest.mark.parametrize(
    "damage",
    [
        lambda held: "not a file of ours",
        lambda held: json.dumps(
            {**held, "power": {**held["power"], "sodium": held["power"]["sodium"][:-1]}}
        ),
        lambda held: json.dumps(
            {**held, "power": {k: v for k, v in held["power"].items() if k != "led_warm"}}
        ),
        lambda held: json.dumps(
            {**held, "tables": {**held["tables"], "sodium": ["SDS_ILLUMINANTS", "HP1"]}}
        ),
        lambda held: json.dumps({**held, "wavelength_nm": (WAVELENGTH_NM + 1).tolist()}),
        lambda held: json.dumps(
            {**held, "power": {**held["power"], "daylight": [float("nan")] * len(WAVELENGTH_NM)}}
        ),
    ],
)
def test_a_damaged_file_is_replaced(tmp_path, looked_up, damage):
    calls, found = looked_up
    measured("sodium")
    path = kept(tmp_path)
    good = path.read_text()
    path.write_text(damage(json.loads(good)))
    np.testing.assert_array_equal(measured("sodium"), found["sodium"])
    assert len(calls) == 2 and path.read_text() == good


def test_a_home_that_cannot_be_written_keeps_nothing(tmp_path, looked_up):
    calls, found = looked_up
    (tmp_path / "home").write_text("a file where the folder should be")
    for _ in range(2):
        np.testing.assert_array_equal(measured("led_white"), found["led_white"])
    assert len(calls) == 2
