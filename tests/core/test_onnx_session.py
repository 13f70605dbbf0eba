"""Networks in ONNX files: what they compute, and files that cannot be read."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import open_session

onnx = pytest.importorskip("onnx", reason="stand-in networks are written by onnx")
pytest.importorskip("onnxruntime", reason="networks are computed by onnxruntime")


def doubling(path: Path) -> Path:
    """Write a network that doubles a picture (1, 3, y, x), and return its path."""
    helper = onnx.helper
    given = helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, [1, 3, "rows", "columns"])
    made = helper.make_tensor_value_info("y", onnx.TensorProto.FLOAT, None)
    node = helper.make_node("Add", ["x", "x"], ["y"])
    graph = helper.make_graph([node], "doubling", [given], [made])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    model.metadata_props.append(onnx.StringStringEntryProto(key="about", value="twice"))
    onnx.save(model, path)
    return path


def test_a_network_is_computed_at_any_size_and_number_type(tmp_path):
    session = open_session(doubling(tmp_path / "two.onnx"), "this")
    [port] = session.inputs
    assert (port.name, port.shape, port.type) == ("x", (1, 3, None, None), "tensor(float)")
    assert session.metadata == {"about": "twice"}
    x = np.arange(36, dtype=np.float64).reshape(1, 3, 3, 4)
    np.testing.assert_array_equal(session.run({"x": x})["y"], 2 * x)


def test_inputs_that_do_not_fit_are_named(tmp_path):
    session = open_session(doubling(tmp_path / "two.onnx"), "this")
    with pytest.raises(ConfigError, match="1 x 3 x free x free; got 1 x 4 x 2 x 2"):
        session.run({"x": np.zeros((1, 4, 2, 2))})
    with pytest.raises(ConfigError, match="has the inputs x; got z"):
        session.run({"z": np.zeros((1, 3, 2, 2))})


@pytest.mark.parametrize("share", [0.0, 0.5, 0.95])
def test_a_truncated_file_is_named_with_its_size(tmp_path, share):
    whole = doubling(tmp_path / "two.onnx").read_bytes()
    cut = tmp_path / "cut.onnx"
    cut.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ConfigError, match=rf"cut\.onnx as an ONNX model .* {cut.stat().st_size} b"):
        open_session(cut, "this")


def test_a_file_that_is_not_there_names_the_nearest(tmp_path):
    doubling(tmp_path / "two.onnx")
    with pytest.raises(ConfigError, match=r"no such file; did you mean '.*two\.onnx'"):
        open_session(tmp_path / "tow.onnx", "this")


def test_a_folder_is_named_as_one(tmp_path):
    with pytest.raises(ConfigError, match="which is a folder; expected an ONNX file$"):
        open_session(tmp_path, "this")
    doubling(tmp_path / "two.onnx")
    with pytest.raises(ConfigError, match=r"which is a folder; .* for example .*two\.onnx$"):
        open_session(tmp_path, "this")


def test_without_onnxruntime_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(ConfigError, match=r"this needs onnxruntime, .* 'isethdr\[onnx\]'"):
        open_session(tmp_path / "two.onnx", "this")
