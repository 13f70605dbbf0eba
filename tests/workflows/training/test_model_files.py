"""Model files: an exporter's notes about the machine are removed; the trained files are small."""

from __future__ import annotations

from pathlib import Path

import pytest
from isethdr_isp.network.contract import KEY
from isethdr_workflows.training.onnx_notes import remove_notes

onnx = pytest.importorskip("onnx")

TRAINED = Path(__file__).parents[3] / "trained"
MOST_BYTES = 5e6


def test_notes_of_nodes_are_removed_and_entries_of_the_file_stay():
    node = onnx.helper.make_node("Relu", ["a"], ["b"], doc_string="File /somewhere/network.py")
    node.metadata_props.add(key="stack_trace", value="File /somewhere/network.py")
    ports = [
        onnx.helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1], "File /somewhere")
        for name in ("a", "b")
    ]
    graph = onnx.helper.make_graph([node], "graph", ports[:1], ports[1:])
    model = onnx.helper.make_model(graph)
    onnx.helper.set_model_props(model, {KEY: "{}"})
    remove_notes(model)
    assert b"somewhere" not in model.SerializeToString()
    assert [entry.key for entry in model.metadata_props] == [KEY]
    onnx.checker.check_model(model)


@pytest.mark.parametrize("folder", ["network_bayer", "network_rgbw"])
def test_trained_files_are_small_and_tell_nothing_of_a_machine(folder):
    content = (TRAINED / folder / "model.onnx").read_bytes()
    assert len(content) < MOST_BYTES
    assert b".py" not in content
    card = (TRAINED / folder / "card.md").read_text()
    assert f"- bytes: {len(content)}\n" in card
