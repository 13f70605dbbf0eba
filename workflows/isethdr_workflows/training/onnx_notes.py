"""Notes of the exporter in a model file: which line of which file of this machine made a node."""

from __future__ import annotations

from typing import Any


def remove_notes(model: Any) -> None:
    """Remove the exporter's notes from an ONNX model, whose own entries stay.

    PyTorch writes a stack trace with absolute paths to each node. They tell others about the
    machine, and make the files of equal networks differ.
    """
    graph = model.graph
    for parts in (graph.node, graph.value_info, graph.input, graph.output, graph.initializer):
        for part in parts:
            part.doc_string = ""
            del part.metadata_props[:]
    graph.doc_string = ""
    del graph.metadata_props[:]
