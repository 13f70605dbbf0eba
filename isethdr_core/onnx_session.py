"""ONNX sessions: networks in files that users bring, computed by onnxruntime on the processor.

This is the only module that imports onnxruntime, which belongs to the extra `onnx`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from .errors import ConfigError, did_you_mean
from .extras import needed

ERRORS_ONLY = 3  # log level of onnxruntime: its warnings concern authors of networks
TYPES = {
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(double)": np.float64,
    "tensor(uint8)": np.uint8,
    "tensor(int32)": np.int32,
    "tensor(int64)": np.int64,
    "tensor(bool)": np.bool_,
}


@dataclass(frozen=True)
class Port:
    """An input or an output of a network."""

    name: str
    shape: tuple[int | None, ...]  # None: any size
    type: str  # as onnxruntime writes it, for example tensor(float)


class OnnxSession:
    """A loaded network.

    Parameters
    ----------
    path : path of the file, for messages.
    session : `onnxruntime.InferenceSession`.
    """

    def __init__(self, path: Path, session: Any) -> None:
        self.path = path
        self._session = session
        self.inputs = tuple(_port(node) for node in session.get_inputs())
        self.outputs = tuple(_port(node) for node in session.get_outputs())

    @property
    def metadata(self) -> dict[str, str]:
        """The free properties of the file (`metadata_props`)."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def run(self, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Compute all outputs.

        Parameters
        ----------
        arrays : {name of an input: array}; each is converted to the number type of its input.

        Returns
        -------
        {name of an output: array}

        Raises
        ------
        ConfigError : an input is missing, unknown or of another shape, or the network fails.
        """
        names = [port.name for port in self.inputs]
        for name in {*arrays} ^ {*names}:
            raise ConfigError(
                f"{self.path} has the inputs {', '.join(names)}; got"
                f" {', '.join(arrays)}{did_you_mean(name, names)}"
            )
        given = {port.name: self._converted(port, arrays[port.name]) for port in self.inputs}
        try:
            found = self._session.run(None, given)
        except Exception as error:  # onnxruntime has a class of its own for each kind of failure
            raise ConfigError(f"{self.path} cannot be computed: {first_line(error)}") from error
        return {port.name: array for port, array in zip(self.outputs, found, strict=True)}

    def _converted(self, port: Port, array: np.ndarray) -> np.ndarray:
        fixed = len(array.shape) == len(port.shape) and all(
            want is None or want == have
            for want, have in zip(port.shape, array.shape, strict=False)
        )
        if not fixed:
            raise ConfigError(
                f"the input {port.name!r} of {self.path} has the shape {shape_text(port.shape)};"
                f" got {shape_text(array.shape)}"
            )
        return np.ascontiguousarray(array, TYPES.get(port.type, array.dtype))


def open_session(path: str | PathLike[str], feature: str, threads: int = 1) -> OnnxSession:
    """Load a network from an ONNX file.

    Parameters
    ----------
    path : path of the file.
    feature : what needs the network, as the subject of messages: "isp=network".
    threads : number of threads of onnxruntime. The default is one, as for linear algebra, because
        processes share the cores.

    Raises
    ------
    ConfigError : there is no such file, it is damaged or no ONNX model, or onnxruntime is not
        installed.
    """
    path = Path(path)
    with needed(feature, extra="onnx"):
        runtime = import_module("onnxruntime")
    if path.is_dir():
        inside = sorted(map(str, path.glob("*.onnx")))
        raise ConfigError(
            f"{feature} reads {path}, which is a folder; expected an ONNX file"
            f"{f' in it, for example {inside[0]}' if inside else ''}"
        )
    if not path.is_file():
        near = sorted(str(other) for other in path.parent.glob("*.onnx"))
        raise ConfigError(
            f"{feature} reads {path}, and there is no such file"
            f"{did_you_mean(str(path), near) if near else '; expected an ONNX file'}"
        )
    options = runtime.SessionOptions()
    options.log_severity_level = ERRORS_ONLY
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    try:
        session = runtime.InferenceSession(
            str(path), sess_options=options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # onnxruntime has a class of its own for each kind of failure
        raise ConfigError(
            f"{feature} cannot read {path} as an ONNX model ({first_line(error)}); expected a"
            f" complete file; this one has {path.stat().st_size} bytes; copy or export it again"
        ) from error
    return OnnxSession(path, session)


def first_line(error: Exception) -> str:
    """Return the first line of an error's text."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def shape_text(shape: tuple[int | None, ...]) -> str:
    """Return a shape for people: `1 x 3 x free x free`."""
    return " x ".join("free" if size is None else str(size) for size in shape) or "a scalar"


def _port(node: Any) -> Port:
    shape = tuple(size if isinstance(size, int) else None for size in node.shape)
    return Port(node.name, shape, node.type)
