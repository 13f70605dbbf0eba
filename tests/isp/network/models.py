"""Small models as ONNX files: a linear demosaic with its variance, and stand-ins for networks."""

from __future__ import annotations

import json

import numpy as np
import onnx
from isethdr_isp.demosaic.interpolation import bilinear
from onnx import TensorProto, helper, numpy_helper

CONTRACT = {
    "contract": 1,
    "cfa": "RG/GB",
    "channels": ["R", "G", "B"],
    "captures": "merged",
    "unit_channel": "G",
    "multiple_px": 2,
    "reach_px": 3,
    "calibration": [{"lux": 1.0, "stated_over_true": 1.0}],
}


def write(path, nodes, ports, weights=(), contract=CONTRACT):
    """Write a model and return its path.

    Parameters
    ----------
    path : file to write.
    nodes : results of `helper.make_node`.
    ports : (inputs, outputs), each {name: shape}; None or a text in a shape is a free size.
    weights : {name: array}.
    contract : content of the property `isethdr`, written as JSON; None writes no property.
    """
    inputs, outputs = (
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, shape) for n, shape in side.items()]
        for side in ports
    )
    kept = [numpy_helper.from_array(np.asarray(v), k) for k, v in dict(weights).items()]
    graph = helper.make_graph(nodes, "model", inputs, outputs, kept)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 9
    if contract is not None:
        helper.set_model_props(model, {"isethdr": json.dumps(contract)})
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return path


def bilinear_model(path, matrix, cell=((0, 1), (1, 2)), contract=CONTRACT):
    """Write bilinear interpolation and a colour matrix as convolutions of whole cells.

    Parameters
    ----------
    path : file to write.
    matrix : (3, channel), from electrons to XYZ in the contract's unit.
    cell : cell of the filter array, numbers of channels row by row.
    contract : content of the property `isethdr`.
    """
    cell = np.array(cell)
    side = len(cell)
    matrix = np.asarray(matrix)
    kernels = bilinear(np.tile(cell, (8, 8)), cell.max() + 1).kernels
    weights = np.zeros((side * side, 3, side * side, 3, 3))
    for kernel in kernels:
        if len(kernel.rows) == 1 or len(kernel.columns) == 1:
            continue  # kernels of the border; the model mirrors samples there
        row = kernel.rows[0] % side
        column = kernel.columns[0] % side
        for (dy, dx), taps in zip(kernel.offsets, (matrix @ kernel.weights).T):
            at = divmod(row + dy, side), divmod(column + dx, side)
            phase = at[0][1] * side + at[1][1]
            weights[row * side + column, :, phase, at[0][0] + 1, at[1][0] + 1] += taps
    weights = weights.reshape(-1, side * side, 3, 3)
    nodes = [
        helper.make_node("Mul", ["noise", "noise"], ["added"]),
        helper.make_node("Add", ["raw", "added"], ["spread"]),
    ]
    for name, source, kernel in (("xyz", "raw", "k"), ("variance", "spread", "k2")):
        nodes += [
            helper.make_node("Pad", [source, "pads"], [f"{name}_p"], mode="reflect"),
            helper.make_node("SpaceToDepth", [f"{name}_p"], [f"{name}_c"], blocksize=side),
            helper.make_node("Conv", [f"{name}_c", kernel], [f"{name}_o"]),
            helper.make_node("DepthToSpace", [f"{name}_o"], [name], blocksize=side, mode="DCR"),
        ]
    ports = (
        {"raw": [1, 1, "y", "x"], "noise": [1, 1, "y", "x"]},
        {"xyz": [1, 3, "y", "x"], "variance": [1, 3, "y", "x"]},
    )
    held = {
        "pads": np.array([0, 0, side, side, 0, 0, side, side]),
        "k": weights.astype(np.float32),
        "k2": (weights**2).astype(np.float32),
    }
    return write(path, nodes, ports, held, contract)


def one_plane(path, name, plane, planes, contract):
    """Write a model that returns plane number `plane` of its input `name` as X, Y and Z."""
    nodes = [
        helper.make_node("Gather", [name, "plane"], ["taken"], axis=1),
        helper.make_node("Concat", ["taken"] * 3, ["xyz"], axis=1),
    ]
    ports = {name: [1, planes, "y", "x"]}, {"xyz": [1, 3, "y", "x"]}
    if name != "raw":
        ports[0]["raw"] = [1, len(contract["captures"]), "y", "x"]
    return write(path, nodes, ports, {"plane": np.array([plane])}, contract)


def convolution(path, side, contract, pads="SAME_UPPER", first="raw"):
    """Write a random convolution of `side` x `side` pixels with a leaky ReLU: a network with a
    reach of `side` // 2 pixels.
    """
    weights = np.random.default_rng(0).normal(size=(3, 1, side, side)).astype(np.float32) / side
    nodes = [
        helper.make_node("Conv", [first, "weights"], ["linear"], auto_pad=pads),
        helper.make_node("LeakyRelu", ["linear"], ["xyz"]),
    ]
    ports = {first: [1, 1, "y", "x"]}, {"xyz": [1, 3, "y", "x"]}
    return write(path, nodes, ports, {"weights": weights}, contract)


def with_mean(path, contract):
    """Write a model that returns the mean of all samples at every pixel."""
    nodes = [
        helper.make_node("ReduceMean", ["raw"], ["mean"], axes=[2, 3]),
        helper.make_node("Mul", ["raw", "zero"], ["black"]),
        helper.make_node("Add", ["black", "mean"], ["flat"]),
        helper.make_node("Concat", ["flat"] * 3, ["xyz"], axis=1),
    ]
    ports = {"raw": [1, 1, "y", "x"]}, {"xyz": [1, 3, "y", "x"]}
    return write(path, nodes, ports, {"zero": np.zeros(1, np.float32)}, contract)


def published(path, planes, size, mean=False):
    """Write a stand-in for a published model: it averages every plane over the sites of its filter.

    Parameters
    ----------
    path : file to write.
    planes : number of input planes, 3 or 4.
    size : rows and columns of the input; None is a free size.
    mean : add the mean over the whole input to each plane instead, a global reach like that of
        attention.
    """
    # share of the sites of each filter in a 2 x 2 array; a Bayer array has green twice
    share = np.array([0.25, 0.5, 0.25] if planes == 3 else [0.25] * 4, np.float32)
    kernel = np.array([[0.25, 0.5, 0.25], [0.5, 1.0, 0.5], [0.25, 0.5, 0.25]], np.float32)
    weights = kernel / 4 / share[:, None, None, None]
    nodes = [
        helper.make_node("Pad", ["input", "pads"], ["wide"], mode="reflect"),
        helper.make_node("Conv", ["wide", "weights"], ["output"], group=planes),
    ]
    if mean:
        nodes = [
            helper.make_node("ReduceMean", ["input"], ["mean"], axes=[2, 3]),
            helper.make_node("Add", ["input", "mean"], ["output"]),
        ]
    shape = [1, planes, size or "y", size or "x"]
    held = {"pads": np.array([0, 0, 1, 1, 0, 0, 1, 1]), "weights": weights}
    return write(path, nodes, ({"input": shape}, {"output": shape}), held, None)
