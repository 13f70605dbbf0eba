"""Detectors in ONNX files return boxes in picture pixels; files that do not fit are refused."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import yaml
from isethdr_workflows.detectors.classes import CLASSES, class_of
from isethdr_workflows.detectors.description import DetectorForm, InputForm, written
from isethdr_workflows.detectors.detector import open_detector
from isethdr_workflows.detectors.picture_input import fit_of, network_input

from isethdr_core.errors import ConfigError

pytest.importorskip("onnx", reason="stand-in detectors are written by onnx")
pytest.importorskip("onnxruntime", reason="detectors are computed by onnxruntime")

from . import standins
from .standins import CELL, HEIGHT, WIDTH, bright_cells, constant, described

SIZE = {"size_px": [WIDTH, HEIGHT]}


def picture(width: int, height: int, box, channel: int = 0) -> np.ndarray:
    """Return a black picture with a bright box (left, top, right, bottom) in one channel."""
    rgb = np.zeros((height, width, 3), np.float32)
    left, top, right, bottom = box
    rgb[top:bottom, left:right, channel] = 1
    return rgb


def test_a_bright_cell_is_found_where_it_is(tmp_path):
    detector = open_detector(described(bright_cells(tmp_path / "d.onnx"), input=SIZE))
    found = detector.in_displayed(picture(WIDTH, HEIGHT, (4, 8, 8, 12)))
    np.testing.assert_allclose(found.boxes, [[4, 8, 8, 12]])
    np.testing.assert_allclose(found.scores, [1.0], rtol=1e-6)  # float32
    assert CLASSES[found.classes[0]] == "car"


@pytest.mark.parametrize("place", ["centre", "corner"])
@pytest.mark.parametrize("size", [(32, 24), (64, 24), (32, 48), (8, 6)])
def test_boxes_come_back_to_the_picture_from_any_letterbox(tmp_path, size, place):
    """A cell of the input, painted into a picture of another size, is found as painted."""
    width, height = size
    form = InputForm(size_px=(WIDTH, HEIGHT), place=place)
    fit = fit_of(width, height, form)
    left, top = fit.offset_px
    cell = np.array([[left, top, left + CELL, top + CELL]]) // CELL * CELL + CELL * (
        np.array([left, top, left, top]) % CELL > 0
    )
    painted = fit.back(cell.astype(float))[0]
    assert (painted == painted.astype(int)).all(), "the sizes above are whole multiples"
    path = described(bright_cells(tmp_path / "d.onnx"), input=SIZE | {"place": place})
    found = open_detector(path).in_displayed(picture(width, height, painted.astype(int)))
    np.testing.assert_allclose(found.boxes[0], painted)


def test_stretching_has_a_scale_for_each_axis(tmp_path):
    path = described(bright_cells(tmp_path / "d.onnx"), input=SIZE | {"fit": "stretch"})
    found = open_detector(path).in_displayed(picture(32, 12, (8, 4, 16, 8)))
    np.testing.assert_allclose(found.boxes[0], [8, 4, 16, 8])


def test_channels_layout_and_scaling_reach_the_network():
    rgb = np.zeros((2, 2, 3), np.float32)
    rgb[0, 1] = (1.0, 0.5, 0.25)
    form = InputForm(
        size_px=(2, 2),
        channels="bgr",
        layout="nhwc",
        full_scale=255,
        mean=(1.0, 2.0, 3.0),
        std=(1.0, 2.0, 4.0),
    )
    array = network_input(rgb, fit_of(2, 2, form), form)
    assert array.shape == (1, 2, 2, 3) and array.dtype == np.float32
    np.testing.assert_allclose(array[0, 0, 1], [63.75 - 1, (127.5 - 2) / 2, (255 - 3) / 4])
    np.testing.assert_allclose(array[0, 1, 0], [-1, -1, -0.75])


def test_a_picture_that_shrinks_keeps_its_mean():
    """Pixels are averaged over areas, so a picture of noise keeps its mean to a few per cent."""
    rgb = np.random.default_rng(1).random((48, 64, 3)).astype(np.float32)
    form = InputForm(size_px=(16, 12))
    array = network_input(rgb, fit_of(64, 48, form), form)
    assert array.mean() == pytest.approx(rgb.mean(), rel=0.02)
    assert array.std() < 0.5 * rgb.std()


def test_without_a_size_the_picture_is_filled_up(tmp_path):
    model = constant(tmp_path / "c.onnx", {"boxes": [[[1, 2, 3, 4]]], "scores": np.eye(1, 5)[None]})
    path = described(model, input={"multiple_px": 8}, output={"form": "apart"})
    detector = open_detector(path)
    assert fit_of(13, 9, detector.form.input).size_px == (16, 16)
    found = detector.in_displayed(np.zeros((9, 13, 3), np.float32))
    np.testing.assert_array_equal(found.boxes, [[1, 2, 3, 4]])


BOXES = np.array([[2.0, 2, 6, 8], [10, 1, 14, 5]])
OF_CLASSES = np.array([[0.1, 0, 0.8, 0, 0], [0.6, 0.2, 0, 0, 0]])


@pytest.mark.parametrize(
    ("output", "arrays"),
    [
        ({"form": "apart"}, {"boxes": BOXES[None], "scores": OF_CLASSES[None]}),
        ({"form": "joined"}, {"all": np.concatenate([BOXES, OF_CLASSES], 1)[None]}),
        (
            {"form": "joined", "boxes_last": True},
            {"all": np.concatenate([BOXES, OF_CLASSES], 1).T[None]},
        ),
        (
            {"form": "joined", "objectness": True},
            {"all": np.concatenate([BOXES, np.full((2, 1), 0.5), 2 * OF_CLASSES], 1)[None]},
        ),
        (
            {"form": "apart", "activation": "sigmoid"},
            {"boxes": BOXES[None], "scores": np.log(OF_CLASSES + 1e-9)[None] * [[[1], [1]]]},
        ),
        ({"form": "labelled"}, {"boxes": BOXES, "scores": [0.8, 0.6], "labels": [2, 0]}),
        ({"form": "rows"}, {"rows": np.c_[BOXES, [0.8, 0.6], [2, 0]]}),
        (
            {"form": "rows", "box": "cxcywh", "unit": "share"},
            {"rows": np.c_[np.array([[4, 5, 4, 6], [12, 3, 4, 4]]) / 16, [0.8, 0.6], [2, 0]]},
        ),
    ],
    ids=["apart", "joined", "last", "objectness", "sigmoid", "labelled", "rows", "shares"],
)
def test_every_form_of_output_says_the_same(tmp_path, output, arrays):
    """The sigmoid of log(p) is p / (1 + p), which keeps the order of the scores."""
    model = constant(tmp_path / "c.onnx", arrays)
    path = described(model, input={"size_px": [16, 16]}, output=output)
    found = open_detector(path).in_displayed(np.zeros((16, 16, 3), np.float32))
    np.testing.assert_allclose(found.boxes, BOXES, atol=1e-5)  # float32
    assert [CLASSES[k] for k in found.classes] == ["person", "car"]
    if output.get("activation") != "sigmoid":
        np.testing.assert_allclose(found.scores, [0.8, 0.6], rtol=1e-5)


def test_boxes_are_cut_at_the_frame_and_others_left_out(tmp_path):
    boxes = [[-5, -5, 5, 5], [20, 20, 30, 30], [np.nan, 0, 1, 1]]
    arrays = {"boxes": boxes, "scores": [0.9, 0.8, 0.7], "labels": [0, 0, 0]}
    path = described(
        constant(tmp_path / "c.onnx", arrays),
        input={"size_px": [16, 16]},
        output={"form": "labelled"},
    )
    found = open_detector(path).in_displayed(np.zeros((16, 16, 3), np.float32))
    np.testing.assert_array_equal(found.boxes, [[0, 0, 5, 5]])


def test_a_class_of_no_interest_is_left_out(tmp_path):
    arrays = {"boxes": BOXES, "scores": [0.9, 0.8], "labels": [7, 0]}
    path = described(
        constant(tmp_path / "c.onnx", arrays),
        input={"size_px": [16, 16]},
        output={"form": "labelled"},
    )
    found = open_detector(path).in_displayed(np.zeros((16, 16, 3), np.float32))
    assert [CLASSES[k] for k in found.classes] == ["car"]


def wrong(tmp_path, match: str, **fields) -> None:
    """Check that a description of `bright_cells` is refused."""
    path = described(bright_cells(tmp_path / "d.onnx"), **({"input": SIZE} | fields))
    with pytest.raises(ConfigError, match=match):
        open_detector(path)


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"classes": {0: "car", 1: "truck"}}, "no class of the network is person, rider, animal"),
        ({"classes": standins.CLASSES | {5: "cra"}}, "class 'cra' is unknown; did you mean 'car'"),
        ({"lacks": ["car"]}, "car is in classes and in lacks"),
        ({"classes": {}}, "classes"),
        ({"classes": {9: "car"}, "lacks": CLASSES[1:]}, "5 columns of scores; expected at least"),
        ({"input": {"size_px": [20, 12]}}, r"size_px: \[16, 12\]"),
        ({"input": {"multiple_px": 8}}, r"size_px: \[16, 12\]"),
        ({"input": SIZE | {"layout": "nhwc"}}, "input.layout|size_px"),
        ({"input": SIZE | {"tones": "png"}}, "tones is no field; did you mean 'tone'"),
        ({"input": SIZE | {"std": [1, 1, 0]}}, "std"),
        ({"output": {"form": "rows"}}, "expected 1 x n x 6"),
        ({"output": {"form": "labelled"}}, "needs 3"),
        (
            {"output": {"form": "rows", "activation": "sigmoid"}},
            "activation is for scores of each class",
        ),
        ({"output": {"form": "labelled", "objectness": True}}, "one score for each box"),
        ({"output": {"form": "apart", "boxes_last": True}}, "expected 1 x 4 x n"),
        ({"output": {"form": "apart", "names": ["boxes", "score"]}}, "did you mean 'scores'"),
        ({"output": {}}, "output.form is missing"),
    ],
)
def test_a_description_that_does_not_fit_is_named(tmp_path, fields, match):
    wrong(tmp_path, match, **fields)


def test_a_truncated_file_and_a_missing_library_are_named(tmp_path, monkeypatch):
    model = bright_cells(tmp_path / "d.onnx")
    path = described(model, input=SIZE)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "onnxruntime", None)
        with pytest.raises(ConfigError, match=r"d\.yaml needs onnxruntime, .*isethdr\[onnx\]"):
            open_detector(path)
    model.write_bytes(model.read_bytes()[:200])
    with pytest.raises(ConfigError, match=r"cannot read .*d\.onnx .* 200 bytes"):
        open_detector(path)


def test_a_description_that_is_no_yaml_or_not_there_is_named(tmp_path):
    path = tmp_path / "d.yaml"
    with pytest.raises(ConfigError, match="expected a YAML file that describes one"):
        open_detector(path)
    path.write_text("model: [")
    with pytest.raises(ConfigError, match="cannot be read as YAML"):
        open_detector(path)


def test_a_description_is_written_as_it_is_read(tmp_path):
    path = described(bright_cells(tmp_path / "d.onnx"), input=SIZE, lacks=[], about="trial")
    form = open_detector(path).form
    assert DetectorForm.model_validate(yaml.safe_load(written(form))) == form


def test_riders_are_people_on_two_wheelers_and_buses_are_trucks():
    rows = [
        ({"category": "person", "name": "person 5"}, "person"),
        ({"category": "person", "name": "rider of bicycle 2"}, "rider"),
        ({"category": "bicycle", "name": "bicycle 2"}, ""),
        ({"category": "bus", "name": "bus 1"}, "truck"),
        ({"category": "boar", "name": "boar 1"}, "animal"),
    ]
    for row, name in rows:
        assert class_of(row) == name
