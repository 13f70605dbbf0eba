"""The report: whole, self-contained, and made of what was computed."""

import re
import socket

import numpy as np
import pytest
from isethdr_catalog.report import pictures, plots, tables, write_report

import isethdr_core as hdr
from isethdr_core import view

SMALL = ["experiment=five_lights", "lens=ideal", "~flare@flare.dirt", "scene.width=64", "scene.height=36"]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture
def result(home, monkeypatch):
    """One run for all tests of this file: computed by the first that asks, read from its store by the others."""
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    return hdr.run(hdr.compose(SMALL))


def test_a_run_writes_its_report_beside_its_store(result):
    html = result.path.with_suffix(".html").read_text()
    for title in ("The scene", "Through the cameras", "Line through the brightest light", "Labels", "Scores", "Ledger",
                  "What was left out", "Config and versions"):
        assert f"<h2>{title}" in html
    for camera in ("bayer", "split_pixel", "rgbw"):
        assert f"<b>{camera}</b>" in html
    for row in result.ledger:
        assert row.stage in html
    assert result.key in html and "numpy" in html and "point_lights" in html


def test_it_needs_no_network(result):
    html = result.path.with_suffix(".html").read_text()
    # namespaces of embedded vector graphics are names, not addresses that a browser loads
    loaded = re.findall(r'(?:src|href)="(?!data:|#)([^"]+)"', html)
    assert not loaded, loaded
    assert "<script" not in html and "@import" not in html


def test_a_missing_report_is_made_again_and_an_old_one_stays(result):
    report = result.path.with_suffix(".html")
    report.unlink()
    again = hdr.run(hdr.compose(SMALL))
    assert not again.computed and report.exists()
    stamp = report.stat().st_mtime_ns
    hdr.run(hdr.compose(SMALL))
    assert report.stat().st_mtime_ns == stamp
    left = report.parent / f".{report.name}.{socket.gethostname()}-999999999-abcdef.tmp"     # no process has this number
    left.touch()
    assert write_report(again) == report and not left.exists(), "what a killed writer left is removed"


def test_intervals_and_missing_numbers_are_shown_as_such(result):
    assert tables.number(float("nan")) == tables.number(None) == "&ndash;"
    assert tables.number(12345.6) == "12,346" and tables.number(0.0012345) == "0.001234"
    html = tables.scores(result, of_objects=False)
    assert ">nan" not in html and "nan " not in html and " to inf" not in html and "inf to" not in html


def test_compression_brings_the_median_to_a_middle_grey():
    day = np.full((8, 8), 600.0)
    a = pictures.compression(day, 4000.0)
    assert view.tone(0.15, a) == pytest.approx(pictures.MIDDLE, abs=1e-6)   # 40 halvings of 100: 1e-10 in a
    assert pictures.compression(day * 1e-5, 4000.0) == pytest.approx(view.COMPRESSION)   # too dark to reach: the default


def test_snr_of_read_noise_alone_is_level_over_noise(result):
    picture, truth = result.open("picture/bayer").load(), result.open("truth/bayer").load()
    picture["variance"][:] = 4.0
    luminance, snr = plots.snr_curve(picture, truth, least=1)
    np.testing.assert_allclose(snr, 20 * np.log10(luminance / 2.0), atol=1e-9)   # rounding of a logarithm
