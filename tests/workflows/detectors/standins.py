"""Stand-in detectors, written by onnx: they find bright cells of a picture, or return constants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import yaml
from onnx import TensorProto, helper, numpy_helper

CELL = 4  # pixels
WIDTH = 16
HEIGHT = 12
CLASSES = {0: "car", 1: "truck", 2: "person", 3: "rider", 4: "animal"}


def saved(path: Path, nodes, inputs, outputs, constants) -> Path:
    """Write a network and return its path.

    Parameters
    ----------
    path : file to write.
    nodes : nodes of the network.
    inputs : {name: shape} of the float32 inputs.
    outputs : names of the outputs.
    constants : {name: array} of the constants.
    """
    graph = helper.make_graph(
        nodes,
        "stand-in",
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in inputs.items()],
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, None) for n in outputs],
        [numpy_helper.from_array(np.asarray(v), n) for n, v in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, path)
    return path


def bright_cells(path: Path, channel: int = 0) -> Path:
    """Write a network that scores each cell by the mean brightness of one channel.

    Its outputs are `boxes` (1, cells, 4), corners in pixels, and `scores` (1, cells, 5). The first
    class has the brightness as its score, and the other classes have 0.
    """
    rows = HEIGHT // CELL
    columns = WIDTH // CELL
    y, x = np.mgrid[:rows, :columns].reshape(2, -1) * CELL
    boxes = np.stack([x, y, x + CELL, y + CELL], 1)[None].astype(np.float32)
    only = np.zeros((1, 3, 1, 1), np.float32)
    only[0, channel] = 1
    pool = {"kernel_shape": [CELL, CELL], "strides": [CELL, CELL]}
    nodes = [
        helper.make_node("Conv", ["picture", "only"], ["plane"]),
        helper.make_node("AveragePool", ["plane"], ["mean"], **pool),
        helper.make_node("Reshape", ["mean", "column"], ["bright"]),
        helper.make_node("MatMul", ["bright", "first"], ["scores"]),
        helper.make_node("Identity", ["grid"], ["boxes"]),
    ]
    constants = {
        "only": only,
        "column": np.array([1, -1, 1]),
        "first": np.eye(1, 5, dtype=np.float32),
        "grid": boxes,
    }
    inputs = {"picture": [1, 3, HEIGHT, WIDTH]}
    return saved(path, nodes, inputs, ["boxes", "scores"], constants)


def constant(path: Path, outputs: dict[str, np.ndarray]) -> Path:
    """Write a network of any input size that returns the same outputs for every picture."""
    nodes = [helper.make_node("Identity", [f"{name}_value"], [name]) for name in outputs]
    # onnx would drop an input that no node reads
    nodes.append(helper.make_node("Identity", ["picture"], ["seen"]))
    constants = {f"{n}_value": np.asarray(v, np.float32) for n, v in outputs.items()}
    inputs = {"picture": [1, 3, "rows", "columns"]}
    return saved(path, nodes, inputs, [*outputs, "seen"], constants)


def described(model: Path, **fields: object) -> Path:
    """Write the description of a network next to its file, and return the description's path."""
    content = {"model": model.name, "output": {"form": "apart"}, "classes": CLASSES} | fields
    path = model.with_suffix(".yaml")
    path.write_text(yaml.safe_dump(content))
    return path
