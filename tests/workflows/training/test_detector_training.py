"""A detector trained for a minute finds drawn squares; a training that was killed goes on."""

from __future__ import annotations

import signal
from dataclasses import replace

import numpy as np
import pytest
import yaml
from isethdr_workflows.detectors.boxes import overlaps
from isethdr_workflows.detectors.detector import open_detector

from isethdr_core.errors import CatalogError, ConfigError

pytest.importorskip("torch", reason="training needs the extra train")
pytest.importorskip("onnxscript", reason="training needs the extra train")
pytest.importorskip("hotcoco", reason="detections are matched by hotcoco")

from isethdr_workflows.training import files
from isethdr_workflows.training.detector import export, training
from isethdr_workflows.training.detector.loss import loss_of, overlap
from isethdr_workflows.training.detector.network import (
    Boxes,
    DetectorNetwork,
    parameters_of,
)
from isethdr_workflows.training.detector.patches import targets_of
from isethdr_workflows.training.detector.settings import Settings
from isethdr_workflows.training.torch_library import torch

from .drawn_roads import drawn, drawn_data

pytestmark = pytest.mark.slow
QUICK = {"dataset": "drawn", "input_px": 128, "patch_px": 64, "batch": 8, "threads": 1}


def silent(_line):
    """Take a line of progress and show nothing."""


def trained(settings: Settings, pictures: int = 200):
    """Return a detector trained on drawn squares."""
    recipe = training.recipe_text(settings, ())
    return training.trained_on(drawn_data(pictures), settings, recipe, silent)


def test_sizes_stay_below_two_million_parameters():
    count = {size: parameters_of(DetectorNetwork(size)) for size in ("small", "large")}
    assert 0.3e6 < count["small"] < count["large"] < 2e6


def test_squares_are_found_after_a_minute(isethdr_home, tmp_path):
    """A detector trained on drawn squares finds squares in pictures that it has not seen."""
    settings = Settings(**QUICK, steps=400, rate=2e-3, checks=5, seed=1)
    run = trained(settings)
    detector = export.exported(run, training.recipe_text(settings, ()))
    found = 0
    asked = 0
    for k in range(20):
        picture = drawn(50_000 + k, "new")
        answer = detector.in_displayed(picture.rgb.astype(np.float32) / 255)
        sure = answer.scores > 0.3
        shared = overlaps(picture.boxes, answer.boxes[sure])
        same = picture.classes[:, None] == answer.classes[sure]
        found += int(((shared > 0.5) & same).any(1).sum())
        asked += len(picture.boxes)
    assert found > 0.8 * asked, (found, asked)
    card = (run.folder / "card.md").read_text()
    assert "drawn squares" in card and "held-0" in card
    form = yaml.safe_load((run.folder / "detector.yaml").read_text())
    assert form["input"]["size_px"] == [128, 96]
    assert len(form["trained_roads"]) == 250
    assert open_detector(run.folder / "detector.yaml").form == detector.form


def test_a_training_that_was_killed_goes_on_and_ends_alike(isethdr_home, monkeypatch):
    """A training that stops half way and continues has the same weights as one without a stop, bit
    for bit.
    """
    whole = trained(Settings(**QUICK, steps=12, checks=4, name="whole", precision="float32"), 8)
    settings = Settings(**QUICK, steps=12, checks=4, name="parts", precision="float32")
    step = training._step

    def killing(run, arrays, rate):
        if run.progress.clock.step == 7:
            raise KeyboardInterrupt
        return step(run, arrays, rate)

    with monkeypatch.context() as patch:
        patch.setattr(training, "_step", killing)
        with pytest.raises(KeyboardInterrupt):
            trained(settings, 8)
    parts = trained(settings, 8)
    assert parts.progress.clock.step == 12
    for name, value in whole.progress.network.state_dict().items():
        torch.testing.assert_close(
            parts.progress.network.state_dict()[name], value, rtol=0, atol=0, msg=name
        )
    steps = [row["step"] for row in parts.progress.history]
    assert steps == [row["step"] for row in whole.progress.history]


def test_ctrl_c_within_a_step_does_not_change_the_weights(isethdr_home, monkeypatch, interrupts):
    """Ctrl-C arrives after the weights of step 7 have changed and before that step is counted."""
    quick = {**QUICK, "steps": 12, "checks": 4, "precision": "float32"}
    whole = trained(Settings(**quick, name="whole"), 8)
    change = torch.optim.AdamW.step
    calls = []

    def typed(optimiser, closure=None):
        change(optimiser, closure)
        calls.append(1)
        if len(calls) == 7:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(torch.optim.AdamW, "step", typed)
        with pytest.raises(KeyboardInterrupt):
            trained(Settings(**quick, name="parts"), 8)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    stored = training.load_state(training.folder_of(Settings(**quick, name="parts")) / "state.pt")
    assert stored["step"] == 7
    parts = trained(Settings(**quick, name="parts"), 8)
    for name, value in whole.progress.network.state_dict().items():
        torch.testing.assert_close(
            parts.progress.network.state_dict()[name], value, rtol=0, atol=0, msg=name
        )


def test_a_training_does_not_continue_with_other_roads(isethdr_home):
    settings = Settings(**QUICK, steps=2, checks=1, name="grown")
    trained(settings, 4)
    with pytest.raises(ConfigError, match="3 roads are new and 0 are gone.*name=grown_2"):
        trained(settings, 7)


def test_narrow_pictures_are_not_enlarged_for_the_network(isethdr_home):
    """The pictures are 128 pixels wide."""
    settings = Settings(**{**QUICK, "input_px": 640}, steps=2, checks=1, name="narrow")
    assert export.form_of(trained(settings, 4)).input.size_px == (128, 96)


def test_every_object_that_is_asked_for_counts_in_the_scores_of_held_out_pictures():
    """An object is asked for from 3 pixels in the shrunk picture, that is 8 in another one."""
    boxes = np.array([[0.0, 0, 9, 3], [0, 0, 9, 20]])
    picture = replace(
        drawn(1, "a"), boxes=boxes, classes=np.array([0, 0]), asked=np.array([True, False])
    )
    assert [one.counted for one in export.objects_of(picture)] == [True, False]


def test_the_size_of_the_cache_does_not_make_another_training():
    settings = Settings(**QUICK, steps=2)
    larger = training.recipe_text(settings, ["lens=ideal", "cache_gb=20"])
    assert larger == training.recipe_text(settings, ["lens=ideal"])


def test_another_recipe_of_the_same_name_is_refused(isethdr_home):
    trained(Settings(**QUICK, steps=2, checks=1, name="one"), 4)
    with pytest.raises(ConfigError, match="other settings .*rate=0.0005.*name=one_2"):
        trained(Settings(**QUICK, steps=2, checks=1, name="one", rate=1e-3), 4)


def test_a_full_disk_keeps_the_state_and_is_named(isethdr_home, monkeypatch):
    settings = Settings(**QUICK, steps=2, checks=1, name="full")

    def full(_file):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(CatalogError, match="No space left"):
        trained(settings, 4)
    assert not (training.folder_of(settings) / training.STATE).exists()


def test_boxes_of_the_exported_graph_are_those_that_the_targets_state():
    """A network with outputs equal to the targets gives the boxes of which the targets are made."""
    boxes = np.array([[10.0, 12, 30, 50], [40, 4, 60, 20]])
    targets = targets_of(boxes, np.array([0, 2]), np.array([True, True]), 64)

    class Says(torch.nn.Module):
        def forward(self, picture):
            heat = torch.from_numpy(targets.heat)[None]
            logits = torch.logit(heat.clamp(1e-4, 1 - 1e-4))
            return logits, torch.from_numpy(targets.sides)[None]

    found, scores = Boxes(Says())(torch.zeros(1, 3, 64, 64))
    for box, kind in zip(boxes, (0, 2)):
        best = scores[0, :, kind].argmax()
        np.testing.assert_allclose(found[0, best].numpy(), box, atol=1e-3)  # float32, 64 px


def test_the_loss_is_least_where_the_network_is_right():
    boxes = np.array([[10.0, 12, 30, 50]])
    targets = targets_of(boxes, np.array([1]), np.array([True]), 64)
    arrays = [torch.from_numpy(v)[None] for v in vars(targets).values()]
    heat, asked, sides, inside = arrays
    right = torch.logit(heat.clamp(1e-4, 1 - 1e-4))
    best = loss_of(right, sides, (heat, asked, sides, inside))
    assert torch.equal(overlap(sides, sides), torch.ones_like(inside[:, 0]))
    for logits, logs in ((-right, sides), (right, sides + 0.5), (torch.zeros_like(right), sides)):
        assert loss_of(logits, logs, (heat, asked, sides, inside)) > best + 0.1
    nothing = torch.zeros_like(asked)
    unasked = loss_of(right, sides, (heat, nothing, sides, nothing))
    assert unasked == 0
