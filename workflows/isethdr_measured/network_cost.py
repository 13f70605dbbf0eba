"""Cost of `isp=network`: seconds per megapixel and memory of an untrained network, by size of tile.

The network is a stand-in: a U-shaped network of plain 3 x 3 convolutions on packed cells, with
random weights. Its picture means nothing, and no score is computed.
"""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_isp.network.contract import KEY, Contract
from isethdr_workflows.accuracy.isp_cost import costs_alone

from isethdr_core import generator
from isethdr_core.extras import needed
from isethdr_core.plugins.registry import build

WIDTH = 28  # channels of the first level: 0.43 million parameters
LEVELS = 2
REACH_PX = 48
TILES_PX = (256, 512, 1024, 4096)
MEGA = 1e6


def network_cost(rows: int = 540, columns: int = 960, width: int = WIDTH) -> list[dict]:
    """Return the CPU seconds per megapixel and the peak memory of isps on a Bayer capture.

    Each isp has a process of its own, so that no memory is left over from another isp.

    Parameters
    ----------
    rows, columns : size of the picture, pixels.
    width : channels of the network's first level.

    Returns
    -------
    rows with isp, setting, parameters of the network, cpu_s_per_megapixel (best of all calls), and
    peak_mb (peak memory above that before the call, with all files open).
    """
    out = []
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "stand_in.onnx"
        parameters = write_stand_in(model, width)
        isps: list[tuple[str, dict[str, Any]]] = [
            ("linear", {}),
            ("linear", {"demosaic": "learned"}),
            ("linear", {"demosaic": "learned", "denoise": "nl_means"}),
            *(("network", {"model": str(model), "tile_px": tile}) for tile in TILES_PX),
        ]
        costs = costs_alone(isps, _shot(rows, columns))
    for (name, fields), cost in zip(isps, costs, strict=True):
        named = [f"{key}={value}" for key, value in fields.items() if key != "model"]
        out.append(
            {
                "isp": name,
                "setting": " ".join(named),
                "parameters": parameters if name == "network" else 0,
                "cpu_s_per_megapixel": cost.cpu_s / (rows * columns / MEGA),
                "peak_mb": cost.peak_mb,
            }
        )
    return out


def _shot(rows: int, columns: int) -> Any:
    scene = build("scene", "uniform", width=columns + 8, height=rows + 8, luminance_cd_m2=10.0)()
    mixed = build("lighting", "ideal")(scene)
    pitch_um = 3.0
    focal_mm = pitch_um * 1e-3 / (mixed.attrs["field_width"] / (columns + 8))
    light = build("lens", "ideal", focal_length_mm=focal_mm, falloff="none")(mixed)
    sensor = build("sensor", "bayer", pitch_um=pitch_um, rows=rows, columns=columns)
    return sensor(light, generator(seed=1))


def write_stand_in(path: Path, width: int) -> int:
    """Write an untrained network with the contract for Bayer arrays; return the number of its
    weights.

    Parameters
    ----------
    path : file of the network.
    width : channels of the network's first level.

    Raises
    ------
    ConfigError : the library onnx is not installed.
    """
    with needed("the study network_cost", extra="test"):
        onnx = import_module("onnx")
        numpy_helper = import_module("onnx.numpy_helper")
    helper = onnx.helper
    graph = _Graph(helper, width)
    weights = [numpy_helper.from_array(values, name) for name, values in graph.weights.items()]
    ports = [
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1, planes, "y", "x"])
        for name, planes in (("raw", 1), ("noise", 1), ("xyz", 3))
    ]
    model = helper.make_model(
        helper.make_graph(graph.nodes, "stand_in", ports[:2], ports[2:], weights),
        opset_imports=[helper.make_opsetid("", 17)],
    )
    model.ir_version = 9
    contract = Contract(
        cfa="RG/GB",
        channels=("R", "G", "B"),
        captures=(),
        unit_channel="G",
        multiple_px=2 << LEVELS,
        reach_px=REACH_PX,
    )
    helper.set_model_props(model, {KEY: contract.to_json()})
    onnx.save(model, str(path))
    return sum(values.size for name, values in graph.weights.items() if name.startswith("w"))


class _Graph:
    """The nodes and weights of a U-shaped network of residual blocks of two 3 x 3 convolutions."""

    def __init__(self, helper: Any, width: int) -> None:
        self.helper = helper
        self.nodes: list[Any] = []
        self.weights: dict[str, np.ndarray] = {}
        self._generator = np.random.default_rng(0)
        self._number = 0
        packed = [self._node("SpaceToDepth", [name], blocksize=2) for name in ("raw", "noise")]
        values = self._convolution(self._node("Concat", packed, axis=1), (8, width))
        kept = []
        for level in range(LEVELS):
            values = self._block(values, width << level)
            kept.append(values)
            values = self._convolution(values, (width << level, width << level + 1), 2, 2)
        values = self._block(values, width << LEVELS)
        for level in reversed(range(LEVELS)):
            values = self._convolution(values, (width << level + 1, 4 * (width << level)), 1)
            values = self._node("DepthToSpace", [values], blocksize=2, mode="CRD")
            values = self._node("Add", [values, kept.pop()])
            values = self._block(values, width << level)
        values = self._convolution(values, (width, 12))
        self._node("DepthToSpace", [values], "xyz", blocksize=2, mode="CRD")

    def _block(self, values: str, width: int) -> str:
        inner = self._node("Relu", [self._convolution(values, (width, width))])
        return self._node("Add", [values, self._convolution(inner, (width, width))])

    def _convolution(
        self, values: str, planes: tuple[int, int], side: int = 3, stride: int = 1
    ) -> str:
        name = f"w{self._number}"
        shape = (planes[1], planes[0], side, side)
        size = np.sqrt(planes[0]) * side
        self.weights[name] = (self._generator.normal(size=shape) / size).astype(np.float32)
        before = (side - 1) // 2 if stride == 1 else 0
        return self._node(
            "Conv", [values, name], pads=[before] * 4, strides=[stride] * 2, kernel_shape=[side] * 2
        )

    def _node(self, kind: str, inputs: list[str], output: str = "", **settings: Any) -> str:
        self._number += 1
        output = output or f"t{self._number}"
        self.nodes.append(self.helper.make_node(kind, inputs, [output], **settings))
        return output
