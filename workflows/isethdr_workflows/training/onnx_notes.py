"""Notes of the exporter in a model file, which name the source file and line behind each node."""

from __future__ import annotations

from typing import Any


def remove_notes(model: Any) -> None:
    """Remove the exporter's notes from an ONNX model. The metadata of the model itself is kept.

    PyTorch adds a stack trace with absolute paths to each node. They reveal details of the machine
    and make the files of equal networks differ.
    """
    graph = model.graph
    for parts in (graph.node, graph.value_info, graph.input, graph.output, graph.initializer):
        for part in parts:
            part.doc_string = ""
            del part.metadata_props[:]
    graph.doc_string = ""
    del graph.metadata_props[:]
