"""The report: complete, self-contained, and consistent with the stored run."""

import base64
import gzip
import io
import json
import re
import socket

import numpy as np
import pytest
import xarray as xr
from isethdr_catalog.compare import compare
from isethdr_catalog.report import page, pictures, plots, tables, templates, viewer, write_report
from isethdr_catalog.report.compare_page import write_compare_page
from markupsafe import Markup
from PIL import Image

import isethdr_core as hdr
from isethdr_core.cli.summary_tables import merged
from isethdr_core.data.reference_picture import before_denoising
from isethdr_core.display import display_view
from isethdr_core.runs.run import Result
from isethdr_core.storage.store import write_store
from isethdr_core.truth import total_variance
from isethdr_core.uncertainty import ledger

SMALL = [
    "experiment=five_lights",
    "lens=ideal",
    "~flare@flare.dirt",
    "scene.width=64",
    "scene.height=36",
    "scene.horizontal_field_deg=8",  # makes the sensor small
    "draws=2",
]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def result(home):
    """Return one run for all tests of this file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISETHDR_HOME", str(home))
        patch.setenv("ISETHDR_CACHE", str(home / "cache"))
        return hdr.run(hdr.compose(SMALL))


def test_a_run_writes_its_report_beside_its_store(result):
    html = result.path.with_suffix(".html").read_text()
    titles = (
        "Pictures",
        "Cameras",
        "Line through the brightest light",
        "Labels",
        "Scores",
        "The scene before any camera",
        "Ledger",
        "Config and versions",
    )
    places = [html.index(f"<h2>{title}") for title in titles]
    assert places == sorted(places), "what was asked for comes first"
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
    assert "<script" not in without_scripts(html) and "@import" not in html


def without_scripts(html):
    """Return the page without its two scripts: the viewer's numbers, and the viewer itself."""
    code = templates.script("viewer.js")
    policy = (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src '{code.digest}'"
    )
    assert f'http-equiv="Content-Security-Policy" content="{policy}"' in html
    data = re.search(r'<script type="application/json" id="viewer-data">([^<]*)</script>', html)
    return html.replace(data[0], "").replace(f"<script>{code.text}</script>", "")


def shown_numbers(html):
    """Return the data that the viewer reads, as Python values."""
    return json.loads(re.search(r'id="viewer-data">([^<]*)</script>', html)[1])


def unpacked(text, itemsize):
    """Return the integers of a plane that `viewer.packed` wrote, row after row."""
    rows = np.frombuffer(gzip.decompress(base64.b64decode(text)), np.uint8)
    return rows.reshape(itemsize, -1).T.copy().view(f"<u{itemsize}").ravel()


def test_the_viewer_holds_what_the_store_says_of_each_pixel(result):
    data = shown_numbers(result.path.with_suffix(".html").read_text())
    assert [entry["name"] for entry in data["entries"]] == ["reference", *result.cameras]
    for entry in data["entries"][1:]:
        picture = result.open(f"picture/{entry['name']}").load()
        captures = result.open(f"captures/{entry['name']}").load()
        y = display_view.luminance(picture).ravel()
        upper = unpacked(entry["luminance"], 2).astype("<u4") << 16
        # the page keeps 8 significant bits, rounded to nearest: relative error of half of 2^-7
        np.testing.assert_allclose(upper.view("<f4"), y, rtol=2.0**-8)
        for k, plane in enumerate(captures["raw"].values):
            np.testing.assert_array_equal(unpacked(entry["raw"][k], 4), plane.ravel())
        mosaic = unpacked(entry["filter"], 1)
        np.testing.assert_array_equal(mosaic, captures["filter"].values.ravel())
        plain = before_denoising(picture)
        assert entry["snr_name"] == "SNR before denoising"
        y, sd = (
            values[..., 1].ravel().astype(float)
            for values in (plain["xyz"].values, np.sqrt(total_variance(plain).values))
        )
        steps = unpacked(entry["snr"], 1).astype(float)
        known = (y > 0) & picture.valid.values.ravel() & (sd > 0)
        assert known.any() and not steps[~known].any(), "0 stands for unknown"
        snr_db = 20 * np.log10(y[known] / sd[known])
        low = data["lowest_db"] + data["step_db"]
        high = data["lowest_db"] + 255 * data["step_db"]
        told = data["lowest_db"] + data["step_db"] * steps[known]
        # SNR is rounded to steps: half a step, and 1e-6 dB for rounding of the step itself
        np.testing.assert_allclose(
            told, np.clip(snr_db, low, high), atol=data["step_db"] / 2 + 1e-6
        )


def test_the_viewer_holds_raw_electrons_without_a_converter():
    raw = np.array([[[-3.25, 0.5], [7.0, 1e6]]], np.float32)
    captures = xr.Dataset(
        {
            "raw": (("capture", "y", "x"), raw),
            "saturated": (("capture", "y", "x"), np.zeros(raw.shape, bool)),
            "filter": (("y", "x"), np.zeros((2, 2), np.uint8)),
        },
        coords={"capture": ["single"], "channel": ["W"]},
    )
    found = viewer._raw(captures)
    assert found["raw_is_float"]
    np.testing.assert_array_equal(unpacked(found["raw"][0], 4).view("<f4"), raw.ravel())
    whole = viewer._raw(captures.assign(raw=captures["raw"].clip(0).astype(np.uint32)))
    assert not whole["raw_is_float"]
    np.testing.assert_array_equal(unpacked(whole["raw"][0], 4), [0, 0, 7, 1_000_000])


def test_noise_is_not_drawn_where_no_picture_states_it(result, monkeypatch):
    assert "Line through the brightest light, and noise" in page.page(result)
    monkeypatch.setattr(plots, "snr_curve", lambda picture, truth: (np.zeros(0), np.zeros(0)))
    html = page.page(result)
    assert "<h2>Line through the brightest light</h2>" in html
    assert page.SNR_NOTE not in html and page.LINE_NOTE in html


def test_a_page_of_very_many_pixels_leaves_their_numbers_out(result, monkeypatch):
    monkeypatch.setattr(viewer, "MOST_PIXELS", 100)
    monkeypatch.setattr(plots, "_svg", lambda *_, **__: Markup())  # no plots are needed
    data = shown_numbers(page.page(result))
    assert not data["told"] and "luminance" not in data["entries"][0]


def test_pictures_are_stored_without_loss():
    rgb = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
    address = pictures.embedded(rgb).removeprefix("data:image/png;base64,")
    with Image.open(io.BytesIO(base64.b64decode(address))) as image:
        np.testing.assert_array_equal(np.asarray(image), rgb)


@pytest.mark.parametrize(
    "value, width, text",
    [
        (29.7312, 0.41, "29.73"),
        (0.054321, 0.012, "0.054"),
        (61512.0, 2300.0, "61,500"),
        (-31.943, 0.057, "-31.943"),
        (-0.0001, 0.1, "0.00"),
        (float("nan"), 1.0, "–"),
    ],
)
def test_scores_have_as_many_digits_as_their_interval_allows(value, width, text):
    assert tables.rounded(value, width) == text


@pytest.mark.slow
def test_a_missing_report_is_made_again_and_an_old_one_stays(result, home, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    report = result.path.with_suffix(".html")
    report.unlink()
    again = hdr.run(hdr.compose(SMALL))
    assert not again.computed and report.exists()
    stamp = report.stat().st_mtime_ns
    hdr.run(hdr.compose(SMALL))
    assert report.stat().st_mtime_ns == stamp
    # no process has this number
    left = report.parent / f".{report.name}.{socket.gethostname()}-999999999-abcdef.tmp"
    left.touch()
    monkeypatch.setattr(plots, "_svg", lambda *_, **__: Markup())  # no plots are needed
    assert write_report(again) == report and not left.exists(), (
        "what a killed writer left is removed"
    )


def test_intervals_and_missing_numbers_are_shown_as_such(result):
    assert tables.number(float("nan")) == tables.number(None) == "–"
    assert tables.number(12345.6) == "12,346" and tables.number(0.0012345) == "0.001234"
    html = tables.scores(result, of_objects=False)
    assert (
        ">nan" not in html and "nan " not in html and " to inf" not in html and "inf to" not in html
    )


HOSTILE = "<script>alert(1)</script>\"'&{{ 7 * 7 }}{% raw %} $\\frac{$ --> ]]> _"


class Renamed:
    """A stored run in which every name is `HOSTILE`: cameras, light groups, metrics, stages."""

    def __init__(self, stored):
        self.stored = stored
        self.path = stored.path
        self.camera = f"_{HOSTILE}"
        a = dict(stored.attributes)
        note = {"what": HOSTILE, "unit": HOSTILE, "how": HOSTILE, "value": 1.0}
        omission = {"what": HOSTILE, "why": HOSTILE, "bound": 1.0, "unit": HOSTILE}
        row = {"stage": HOSTILE, "seconds": 1.0, "peak_bytes": 0}
        score = {"camera": self.camera, "metric": HOSTILE, "unit": HOSTILE, "value": 1.0}
        bounds = {"low": 0.5, "high": 1.5}
        a["ledger"] = [row | {"errors": [note], "left_out": [omission]}]
        a["scores"] = [score | bounds | {"object": o} for o in ("", HOSTILE)]
        # two cameras with unlike shares of valid pixels, so that the page remarks on them
        for camera, share in ((self.camera, 0.2), ("other", 0.9)):
            named = {"camera": camera, "metric": "valid_share", "value": share}
            a["scores"] += [score | bounds | named | {"object": o} for o in ("", HOSTILE)]
        limits = {"value": 0.4, "limit": 0.05, "unit": HOSTILE}
        a["warnings"] = [
            {"key": key, "camera": self.camera} | limits for key in (HOSTILE, "saturated_frame")
        ]
        a["weights"] = {HOSTILE: 1.0}
        a["lighting"] = a["lens"] = a["created"] = a["key"] = HOSTILE
        targets = {HOSTILE: {"wanted": 1.0, "reached": 2.0}}
        a["lighting_notes"] = {"infeasible": HOSTILE, "targets": targets}
        a["config"] = {"scene": {"name": HOSTILE}, HOSTILE: {HOSTILE: HOSTILE}}
        a["cameras"] = [self.camera]
        a["versions"] = a["code"] = {HOSTILE: HOSTILE}
        self.attributes = a
        self.cameras = [self.camera]
        self.scores = a["scores"]
        self.ledger = ledger.Ledger.from_records(a["ledger"])

    def open(self, group):
        """Return the stored run's group for `group`, in which the camera has a hostile name."""
        opened = self.stored.open(group.replace(self.camera, self.stored.cameras[0]))
        objects = opened.attrs.get("objects") or []
        return opened.assign_attrs(objects=[o | {"category": HOSTILE} for o in objects])


@pytest.mark.slow
def test_two_runs_stand_side_by_side(result, home):
    """The page of a run compared with itself shows all pictures of both, and no difference."""
    found = compare(home, result.key[:8], result.key)
    html = write_compare_page(found, home / "comparisons").read_text()
    for camera in result.cameras:
        assert f"<b>A {camera}</b>" in html and f"<b>B {camera}</b>" in html
    assert html.count("<img") == 1 + 2 * len(result.cameras)
    assert f'href="../runs/{result.key}.html"' in html and not found.settings
    assert found.scores and not any(pair.differs for pair in found.scores)


@pytest.fixture(scope="module")
def renamed_page(result):
    """Return the page of a run with hostile names."""
    return page.page(Renamed(result))


def test_names_are_text_and_never_markup(renamed_page):
    html = without_scripts(renamed_page)
    assert "<script" not in html and "onerror=" not in html
    assert html.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 30, "shown wherever a name is"
    assert "{{ 7 * 7 }}{% raw %}" in html, "a name is no template"
    svg_names = re.findall(r"<text[^>]*>([^<]*alert[^<]*)</text>", html)
    assert svg_names and all("\\frac{$" in name for name in svg_names), (
        "in plots, `$` is no formula"
    )


def test_warnings_and_unlike_shares_are_told(renamed_page):
    html = renamed_page
    assert "40.0% of the frame outside lamps is saturated in every capture (limit 5%)" in html
    assert "Shares of valid pixels differ by more than 0.05" in html
    assert "Objects whose shares of valid pixels differ by more than 0.05" in html


def test_compression_brings_the_mean_to_a_middle_grey():
    day = np.full((8, 8), 600.0)
    a = pictures.compression(day, 4000.0)
    # 40 bisections of the interval from 0 to 100 leave 1e-10 in the compression
    assert display_view.tone(0.15, a) == pytest.approx(pictures.MIDDLE, abs=1e-6)
    # so dark a scene cannot reach the middle grey, and gets the default compression
    assert pictures.compression(day * 1e-5, 4000.0) == pytest.approx(display_view.COMPRESSION)


def test_a_grey_scene_with_lamps_shows_grey():
    dark = np.full((40, 60), 0.1)
    dark[20, 30] = 1e6
    white = pictures.shown_white_cd_m2(dark)
    rgb = display_view.display(
        np.repeat(dark[..., None], 3, axis=-1), white, pictures.compression(dark, white)
    )
    assert 100 < rgb[0, 0].mean() < 200, "neither black nor white"
    assert rgb[20, 30].min() > 240, "the lamp is white, in the colour of equal energy"


def test_white_of_a_chart_shows_white_and_a_night_has_room_for_its_lamps():
    chart = np.geomspace(1.0, 90.0, 400).reshape(20, 20)
    assert pictures.shown_white_cd_m2(chart) == pytest.approx(90.0)
    night = np.geomspace(0.001, 8.0, 400).reshape(20, 20)
    night[0, 0] = 1e5
    white = pictures.HEADROOM * display_view.white_cd_m2(night)
    assert pictures.shown_white_cd_m2(night) == white


def test_flare_in_the_dark_does_not_show_as_a_white_area():
    dark = np.full((40, 60), 0.1)
    flared = dark.copy()
    flared[:, :15] = 30.0  # a quarter of the picture
    flared[:, :5] = 1000.0
    white = pictures.shown_white_cd_m2(dark, [flared])
    assert white == 30.0
    # a picture that is nowhere much brighter than the scene does not move the white
    assert pictures.shown_white_cd_m2(dark, [dark + 0.01]) == pictures.shown_white_cd_m2(dark)


@pytest.mark.parametrize(
    "low, high, ticks",
    [
        (0.1, 1e6, ["0.1", "1", "10", "100", "1000", "10^4", "10^5", "10^6"]),
        (3.0, 90.0, ["5", "10", "20", "50"]),
        (3e4, 3e5, ["5·10^4", "10^5", "2·10^5"]),
    ],
)
def test_the_colour_scale_has_ticks_in_every_range(low, high, ticks):
    shown = pictures.colour_scale(low, high).ticks
    assert [text + (f"^{e}" if e is not None else "") for _, text, e in shown] == ticks
    values = [
        float(text.replace("·10", "").replace("^", "e")) for text in ticks if "10^" not in text
    ]
    places = [100 * np.log(v / low) / np.log(high / low) for v in values]
    for place in places:
        assert min(abs(place - percent) for percent, _, _ in shown) < 1e-9  # rounding


def test_a_score_that_one_camera_lacks_stands_beside_its_neighbour():
    assert merged([["a", "c"], ["a", "b", "c", "d"], []]) == ["a", "b", "c", "d"]


def test_a_name_breaks_at_its_underscores_and_stays_escaped():
    assert templates.breakable("snr_at_<1>") == "snr_<wbr>at_<wbr>&lt;1&gt;"


def test_a_very_narrow_interval_is_shown_by_its_half():
    score = {"value": 3.6119612, "low": 3.6119542, "high": 3.6119682}
    assert [part.text for part in tables._value(score)] == ["3.612", "± 7e-06"]


def test_snr_of_a_constant_variance_is_level_over_noise(result):
    picture = before_denoising(result.open("picture/bayer").load())
    truth = result.open("truth/bayer").load()
    picture["variance"][:] = 1.0
    # both variances are noise of a pixel; together they are 4 (cd/m2)^2
    picture["fixed_pattern_variance"] = 3.0 + 0 * picture["variance"]
    luminance, snr = plots.snr_curve(picture, truth, least=1)
    # tolerance in dB: rounding of a logarithm
    np.testing.assert_allclose(snr, 20 * np.log10(luminance / 2.0), atol=1e-9)


@pytest.mark.parametrize(
    "attrs, angle_deg, place",
    [
        ({}, 30.0, np.tan(np.radians(30))),
        (
            {"distortion": {"model": "brown_conrady", "k1": -0.2}},
            30.0,
            np.tan(np.radians(30)) * (1 - 0.2 / 3),
        ),
        ({"projection": "equidistant"}, 100.0, np.radians(100)),
        (
            {"projection": "equidistant", "distortion": {"model": "kannala_brandt", "k1": -0.02}},
            80.0,
            np.radians(80) - 0.02 * np.radians(80) ** 3,
        ),
    ],
)
def test_the_profile_is_drawn_over_the_angle_at_which_a_pixel_looks(attrs, angle_deg, place):
    """On the row through the axis, the angle is the field angle by the formula of the lens.

    Without distortion, a rectilinear lens has the same horizontal angle in all rows of a column.
    """
    x = np.array([-place, 0.0, place]) * 4e-3
    y = np.array([0.0, 1e-3])
    picture = xr.Dataset(coords={"y": y, "x": x}, attrs={"focal_length_mm": 4.0, **attrs})
    np.testing.assert_allclose(
        page._angles_deg(picture, 0), [-angle_deg, 0.0, angle_deg], atol=1e-9
    )
    if not attrs:
        np.testing.assert_allclose(
            page._angles_deg(picture, 1), page._angles_deg(picture, 0), atol=1e-9
        )


def test_a_run_without_a_report_stores_no_scene_for_a_page(tmp_path):
    """Its page, written later, has no section of the scene."""
    attributes = {"kind": "run", "key": "r", "lighting": "ideal", "versions_shown": []}
    path = write_store(tmp_path, "r", {}, attributes)
    assert page._scene(Result(path, attributes, computed=False)) == []
