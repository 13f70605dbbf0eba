"""Model files: a bad file is one error that says what to type, and the content of the file is part
of a run's name.
"""

import json
import sys
from importlib.metadata import version

import numpy as np
import pytest
from isethdr_isp.network.contract import Contract

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import ShotForm, check_shots
from isethdr_core.runs.provenance import input_digests, libraries

SPLIT = ["LPLG", "LPHG", "SPLG"]


@pytest.fixture
def model(models, tmp_path):
    """Return a function that writes a model with a changed contract and returns its path."""

    def make(name="model.onnx", **changed):
        contract = {**models.CONTRACT, "reach_px": 8, "calibration": "unknown", **changed}
        return models.convolution(tmp_path / name, 5, contract)

    return make


def refused(path, message, **fields):
    """Check the error that `check_shot` raises, which the chain calls before any work."""
    isp = hdr.build("isp", "network", model=str(path), **fields)
    with pytest.raises(ConfigError, match=message):
        isp.check_shot(ShotForm(("single",), ("RG", "GB")))


def test_sensors_are_checked_before_any_work(model):
    sensors = [hdr.build("sensor", "bayer")]
    path = model()
    isp = hdr.build("isp", "network", model=str(path))
    check_shots(sensors, isp)
    model(cfa="RG/WB", channels=["R", "G", "W", "B"])
    with pytest.raises(ConfigError, match="filter array RG/WB; the sensor has RG/GB"):
        check_shots(sensors, isp)


def test_no_model_is_named():
    refused("", "isp.model is ''.* type isp.model=FILE.onnx")


def test_a_missing_file_names_one_that_is_there(model, tmp_path):
    model("bayer.onnx")
    refused(tmp_path / "bayr.onnx", "no such file; did you mean '.*bayer.onnx'")


def test_a_truncated_file(model):
    path = model()
    path.write_bytes(path.read_bytes()[:-200])
    refused(path, "cannot read .*expected a complete file")


def test_a_file_that_is_no_model(tmp_path):
    path = tmp_path / "model.onnx"
    path.write_text("weights")
    refused(path, "cannot read .*expected a complete file")


def test_without_onnxruntime_the_error_says_what_to_type(model, monkeypatch):
    path = model("fresh.onnx")
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    refused(path, r"isp=network needs onnxruntime.*'isethdr\[onnx\]'")


def test_another_filter_array(model):
    path = model(cfa="RG/WB", channels=["R", "G", "W", "B"])
    refused(path, "filter array RG/WB; the sensor has RG/GB")


def test_a_filter_array_with_two_exposures(model, models, tmp_path):
    """A filter array of the model cannot be advised, because `interleaved` needs both cases."""
    joint = {**models.CONTRACT, "captures": SPLIT, "calibration": "unknown"}
    form = hdr.build("sensor", "interleaved").shot_form()
    for path in (model(), models.one_plane(tmp_path / "joint.onnx", "raw", 0, 3, joint)):
        with pytest.raises(
            ConfigError, match="holds two exposures, .* type isp=merge, without isp.model$"
        ):
            hdr.build("isp", "network", model=str(path)).check_shot(form)


def test_another_number_of_captures(models, tmp_path):
    contract = {**models.CONTRACT, "captures": SPLIT, "calibration": "unknown"}
    path = models.one_plane(tmp_path / "joint.onnx", "raw", 0, 3, contract)
    refused(path, "joins the captures LPLG, LPHG, SPLG; the sensor has")


def test_planes_that_the_file_does_not_state(models, tmp_path):
    contract = {**models.CONTRACT, "captures": SPLIT}
    path = models.convolution(tmp_path / "planes.onnx", 5, contract)
    refused(path, "'raw' with the shape 1 x 1 x .* expected 1 x 3 x free")


def test_inputs_of_another_name(models, tmp_path):
    path = models.convolution(tmp_path / "named.onnx", 5, models.CONTRACT, first="mosaic")
    refused(path, "has the inputs mosaic; expected raw, and any of noise")


def test_a_file_without_the_property(models, tmp_path):
    path = models.convolution(tmp_path / "bare.onnx", 5, None)
    refused(path, "has the inputs raw and no property 'isethdr'")


def test_optical_black_of_a_sensor_without_it(model):
    refused(model(), "sensor has no optical black rows", black="optical")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"contract": 2}, "isethdr.contract=2; expected 1"),
        ({"cfa": "RG/G"}, "isethdr.cfa='RG/G'; expected rows of equal length"),
        ({"channels": ["R", "G"]}, "isethdr.channels=.* expected every letter of RG/GB once"),
        ({"unit_channel": "W"}, "isethdr.unit_channel='W'; expected one of R, G, B"),
        ({"multiple_px": 7}, "isethdr.multiple_px=7; expected a multiple of the cell"),
        ({"multiple_px": "many"}, "isethdr.multiple_px: .*got 'many'"),
        ({"captures": "all"}, "isethdr.captures='all'; expected \"merged\""),
        ({"captures": []}, r"isethdr.captures=\[\]; expected \"merged\""),
        ({"calibration": "good"}, "isethdr.calibration='good'; expected \"unknown\""),
        ({"calibration": [{"lux": 1}]}, "isethdr.calibration.*stated_over_true: Field required"),
        ({"quantum_efficiency": {"R": [1.0]}}, "isethdr.quantum_efficiency=.*one curve per"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_a_contract_that_is_wrong(models, changed, message):
    with pytest.raises(ConfigError, match=message):
        Contract.from_json(json.dumps({**models.CONTRACT, **changed}), "model.onnx")


def stated(**changed):
    """Return a contract that an author writes in Python, with some fields changed."""
    fields = {"cfa": "RG/GB", "channels": ("R", "G", "B"), "captures": (), "unit_channel": "G"}
    return Contract(**{**fields, "multiple_px": 8, **changed})


def test_a_contract_takes_the_forms_that_the_page_has_for_the_file():
    points = [{"lux": 0.1, "stated_over_true": 1.04}]
    contract = stated(captures="merged", calibration=points)
    assert contract.planes == 1 and contract.worst_ratio() == 1.04
    assert json.loads(contract.to_json())["captures"] == "merged"
    assert json.loads(contract.to_json())["calibration"] == points
    assert Contract.from_json(contract.to_json()) == contract
    assert stated(captures="merged", calibration="unknown") == stated()
    assert stated(captures=SPLIT).captures == tuple(SPLIT)
    for names in ((name for name in SPLIT), np.array(SPLIT)):
        contract = stated(captures=names)
        assert contract.captures == tuple(SPLIT)
        assert json.loads(contract.to_json())["captures"] == SPLIT


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"captures": "LPLG"}, "captures='LPLG'; expected the names .* type for example captures="),
        ({"captures": None}, "captures=None; expected the names"),
        ({"captures": (1, 2)}, r"captures=\(1, 2\); expected the names"),
        ({"calibration": np.array([1.0, 2.0])}, 'calibration.0=.*; expected "unknown", or points'),
        ({"calibration": "good"}, "calibration='good' .*; expected \"unknown\", or points"),
        ({"calibration": [{"lux": 1.0}]}, r"calibration.0.stated_over_true=.*Field required"),
        ({"calibration": [{"lux": 1.0, "stated_over_true": 0.0}]}, "stated_over_true=0.0"),
    ],
    ids=["captures", "none", "numbers", "array", "text", "key", "zero"],
)
def test_a_contract_of_an_author_that_is_wrong(changed, message):
    with pytest.raises(ConfigError, match=message):
        stated(**changed)


def test_a_contract_that_is_no_json():
    with pytest.raises(ConfigError, match="which is no JSON"):
        Contract.from_json("{contract: 1", "model.onnx")


def test_a_contract_survives_its_json(models):
    full = {
        **models.CONTRACT,
        "captures": SPLIT,
        "reach_px": None,
        "quantum_efficiency": {"R": [0.1, 0.6], "G": [0.2, 0.4], "B": [0.6, 0.1]},
        "wavelength_nm": [450.0, 600.0],
        "range_e": [0.5, 3000.0],
        "recipe": "abc",
    }
    for stated in (models.CONTRACT, full):
        contract = Contract.from_json(json.dumps(stated))
        assert json.loads(contract.to_json()) == stated
        assert Contract.from_json(contract.to_json()) == contract


def test_another_file_or_another_onnxruntime_renames_the_run(model):
    path = model()
    isp = hdr.build("isp", "network", model=str(path))
    assert libraries(isp)["onnxruntime"] == version("onnxruntime")
    assert "onnxruntime" not in libraries(hdr.build("isp", "linear"), frame=True)
    before = input_digests(isp)
    assert list(before) == [str(path)]
    model(recipe="another")
    assert input_digests(isp) != before
