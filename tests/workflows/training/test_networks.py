"""Networks and their training, if PyTorch is installed: tiny trainings that take seconds."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
import yaml

pytest.importorskip("torch", reason="the extra train is not installed")

from isethdr_workflows.training.picture import (
    action,
    export,
    finish,
    held_out,
    linear_fit,
    training,
)
from isethdr_workflows.training.picture.camera import camera_of
from isethdr_workflows.training.picture.leaves import WAVELENGTH_NM
from isethdr_workflows.training.picture.loss import Batch, loss_of, weight
from isethdr_workflows.training.picture.networks import choice, picture_network
from isethdr_workflows.training.picture.networks.picture_network import (
    interpolated,
    parameters,
)
from isethdr_workflows.training.picture.settings import Settings
from isethdr_workflows.training.picture.sheets import Patches, dark_noise_e2
from isethdr_workflows.training.torch_library import torch

from isethdr_core import generator
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.onnx_session import open_session
from isethdr_core.plugins.registry import build

TINY = {"pictures": 3, "picture_px": 48, "patch_px": 48, "batch": 2, "checks": 3}
BAYER = ["sensor=bayer"]
SIDE = 48


@pytest.fixture(scope="module")
def camera():
    """Return a camera with one photodiode and one reading per pixel."""
    return camera_of(BAYER)


@pytest.fixture
def own_home(tmp_path, monkeypatch):
    """Return a home of the test's own, and fit linear starts to few sheets."""
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    monkeypatch.setattr(linear_fit, "SHEETS", 2)
    return tmp_path


class Known(NamedTuple):
    """Sheets of random levels with weighted sums of neighbours as their truth."""

    noise_e: float

    def sheet(self, number):
        """Return patches: X is the sample, Y twice its left neighbour, Z the mean of two rows."""
        rng = np.random.default_rng(number)
        level = np.exp(rng.uniform(np.log(5), np.log(2000), (training.SHEET, 1, 1, 1)))
        light = level * rng.uniform(0.5, 1.5, (training.SHEET, 1, SIDE, SIDE))
        truth = [light, 2 * np.roll(light, 1, -1), (light + np.roll(light, 1, -2)) / 2]
        raw = light + self.noise_e * rng.normal(size=light.shape)
        valid = np.ones_like(raw)
        valid[..., 0, :] = valid[..., 0] = 0  # without neighbours
        planes = (raw, np.full_like(raw, self.noise_e), valid, np.concatenate(truth, 1))
        return Patches(*(values.astype(np.float32) for values in planes))


def settings(**changed):
    return Settings(**{**TINY, "steps": 6, **changed})


def test_small_networks_have_at_most_half_a_million_parameters(camera):
    for name, size in choice.SHAPES:
        count = parameters(choice.network_of(camera, name, size))
        assert (count <= 500_000) == (size == "small"), (name, size, count)


@pytest.mark.parametrize(
    ("name", "start"),
    [("unet", "linear"), ("unet", "learned"), ("nafnet", "linear"), ("restormer", "linear")],
)
def test_an_output_depends_on_samples_within_the_stated_reach_only(camera, name, start):
    network = choice.network_of(camera, name, "small", start).eval()
    for parameter in network.parameters():  # so that every layer has an effect
        torch.nn.init.normal_(parameter, std=0.1)
    if start == "linear":
        torch.nn.init.normal_(network.start.weight, std=0.1)
    reach = choice.reach_px(camera, name, "small", start)
    side = 256
    inputs = list(export.example(camera, side, side, seed=1))
    inputs[0].requires_grad_()
    middle = side // 2
    network(*inputs)[0][..., middle, middle].sum().backward()
    rows, columns = np.nonzero(inputs[0].grad[0, 0].numpy())
    away = max(np.abs(rows - middle).max(), np.abs(columns - middle).max())
    assert away <= reach and (np.isinf(reach) or away > reach / 2), (away, reach)


@pytest.mark.parametrize(("start", "off"), [("linear", 1e-4), ("learned", 0.1)])
def test_before_training_a_picture_is_near_the_light(camera, start, off):
    network = choice.network_of(camera, "unet", "small", start).eval()
    shape = 1, 1, 32, 32
    level = 400.0
    masks = torch.from_numpy(camera.masks(32, 32))[None]
    flat = torch.full(shape, level), torch.ones(shape), masks, torch.ones(shape)
    xyz, variance = network(*flat)
    inner = (..., slice(8, -8), slice(8, -8))
    # linear: the start is a mean, in float32; learned: the start has 100 taps with random weights
    # of 1e-3 each
    assert torch.allclose(xyz[inner], torch.tensor(level), rtol=off)
    assert (variance > 0).all()


@pytest.mark.parametrize("captures", ["merged", "apart"])
def test_a_small_error_of_the_root_is_a_small_error_of_bright_light(captures):
    """The root of a large signal is about the signal's root, also where the sample comes from a
    small photodiode, whose scaled shot noise is 10 times as large.
    """
    split = camera_of(["sensor=split_pixel"], captures)
    network = choice.network_of(split, "unet", "small").eval()
    network.limit_floor(dark_noise_e2(split, WAVELENGTH_NM))
    shape = 1, split.planes, 32, 32
    level = 3e4
    noise = torch.full(shape, (99 * level) ** 0.5)
    masks = torch.from_numpy(split.masks(32, 32))[None]
    # 1 % of the root of the light, for a network that adds the same number everywhere
    change = 0.01 * level**0.5 / picture_network.SCALE
    before = network(torch.full(shape, level), noise, masks, torch.ones(shape))[0]
    torch.nn.init.zeros_(network.body.tail.weight)
    network.body.tail.bias.data[: network.outputs[0]] = change
    after = network(torch.full(shape, level), noise, masks, torch.ones(shape))[0]
    assert float((after.mean() / before.mean()).detach()) == pytest.approx(1.02, abs=0.002)


def test_in_the_dark_the_floor_is_the_whole_read_noise(camera):
    """One capture has the same noise at every level, so its root is not changed by the limit."""
    network = choice.network_of(camera, "unet", "small").eval()
    example = export.example(camera, 32, 32, seed=0)
    noise_e2 = dark_noise_e2(camera, WAVELENGTH_NM)
    inputs = example[0], torch.full_like(example[1], float(noise_e2[0]) ** 0.5), *example[2:]
    unlimited = network(*inputs)[0]
    network.limit_floor(noise_e2)
    assert torch.equal(network(*inputs)[0], unlimited)
    split = camera_of(["sensor=split_pixel"])
    # read noise of about 1 e, and the scaled captures have next to no weight in the dark
    assert 0.5 < dark_noise_e2(split, WAVELENGTH_NM)[0] < 5


def test_the_fitted_start_is_the_linear_estimate_of_least_error(camera, monkeypatch):
    """If the truth is a linear function of the raw and its neighbours, the fit is exact. Noise in
    the raw makes the filters smoother.
    """
    monkeypatch.setattr(linear_fit, "SHEETS", 4)
    left = Known(noise_e=0.0)
    network = choice.network_of(camera, "unet", "small")
    linear_fit.fit(network.start, left)
    raw, noise, valid, truth = (torch.from_numpy(v) for v in left.sheet(9))
    masks = torch.from_numpy(camera.masks(SIDE, SIDE))[None]
    with torch.no_grad():
        xyz, _ = network(raw, noise, masks, valid)
    inner = (..., slice(6, -6), slice(6, -6))  # the border lacks samples
    # 5e-3: the ridge of the fit is 1e-6 of the mean square of a sample
    assert torch.allclose(xyz[inner], truth[inner], rtol=5e-3, atol=0.05)

    noisy = choice.network_of(camera, "unet", "small")
    linear_fit.fit(noisy.start, Known(noise_e=20.0))
    assert noisy.start.weight.square().sum() < 0.9 * network.start.weight.square().sum()


def test_a_batch_holds_patches_of_as_many_sheets_and_is_the_same_after_a_restart():
    sheets = Known(noise_e=1.0)
    first, again = (training.Batches(sheets, 4, "cpu") for _ in range(2))
    batch = first.of(5)
    for row in range(4):
        expected = sheets.sheet(row).raw[5]
        assert np.array_equal(batch.raw[row].numpy(), expected)
    for earlier in (3, 4):
        again.of(earlier)
    assert torch.equal(again.of(5).truth, batch.truth)
    assert np.array_equal(first.of(training.SHEET).raw[0].numpy(), sheets.sheet(4).raw[0])


def test_the_loss_is_least_at_the_mean_of_all_truths_that_fit():
    """Half of the pixels are 8 e and half 12 e, and the raw does not distinguish them: the loss is
    least at 10 e.
    """
    shape = 2, 1, 16, 16
    truth = torch.full((2, 3, 16, 16), 8.0)
    truth[..., ::2] = 12.0
    batch = Batch(torch.full(shape, 10.0), torch.ones(shape), torch.ones(shape), truth)
    levels = torch.linspace(8, 12, 41)
    losses = [
        float(loss_of("electrons", torch.full_like(truth, float(v)), torch.ones_like(truth), batch))
        for v in levels
    ]
    assert levels[int(np.argmin(losses))] == pytest.approx(10.0, abs=0.01)


def test_the_weight_follows_the_raw_and_never_the_truth():
    shape = 1, 1, 16, 16
    raw = torch.full(shape, 100.0)
    batches = [
        Batch(raw, torch.full(shape, 2.0), torch.ones(shape), torch.full((1, 3, 16, 16), t))
        for t in (50.0, 500.0)
    ]
    first, second = (weight(batch) for batch in batches)
    assert torch.equal(first, second)
    # local mean + noise^2 + 1 + 1e-3 of the mean's square
    assert torch.allclose(first, torch.tensor(1 / (100 + 4 + 1 + 10.0)))


def test_interpolation_is_linear_between_places_and_constant_beyond():
    places = torch.tensor([0.0, 1.0, 3.0])
    values = torch.tensor([2.0, 4.0, 0.0])
    x = torch.linspace(-2, 5, 29)
    expected = np.interp(x.numpy(), places.numpy(), values.numpy())
    assert np.allclose(interpolated(x, places, values).numpy(), expected, atol=1e-6)


def test_calibration_makes_the_stated_variance_true(camera, own_home):
    run = training.trained(settings(steps=2), BAYER, lambda line: None)
    network, _ = training.final_network(run)
    held_out.calibrate(network, run.judge)
    for row in held_out.rows_of(network, run.judge):
        # the variance is calibrated for each level of light; one illuminance mixes many levels
        assert 0.5 < row["stated_over_true"] < 2.0, row


def test_the_card_measures_on_patches_that_no_check_and_no_calibration_saw(camera, own_home):
    run = training.trained(settings(steps=2), BAYER, lambda line: None)
    network, _ = training.final_network(run)
    sheets = run.held_out_sheets["dead leaves"]
    rows = held_out.rows_of_new_sheets(network, sheets, 0.01, "cpu")
    assert [row["lux"] for row in rows] == [0.003, 0.01]
    # the same by hand for the second illuminance: its sheets are numbers 11, 21, ...
    numbers = [1 + 10 * k for k in range(1, held_out.NEW_SHEETS + 1)]
    parts = [replace(sheets, lux=(0.01, 0.01)).sheet(number) for number in numbers]
    truth = np.concatenate([part.truth[:, 1] for part in parts])
    assert len(truth) == 256
    # at this illuminance no sample is clipped, so that all pixels count
    assert rows[1]["mean_e"] == pytest.approx(float(truth.mean(dtype=float)), rel=1e-6)
    checked = run.judge.levels[1].patches.truth[:, 1].numpy()
    assert not any(np.array_equal(one, other) for one in truth for other in checked)


def test_the_interval_of_a_mean_error_holds_the_truth_in_95_percent():
    rng = np.random.default_rng(8)
    held = 0
    for _ in range(2000):
        true = rng.uniform(0.5, 2.0, 16)
        seen = 1.02 * true + rng.normal(0, 0.1, 16)
        ratio = seen.sum() / true.sum()
        held += abs(ratio - 1.02) <= held_out.half_width_of_ratio(seen, true)
    # a share of 2000 has a standard error of 0.005; three of them
    assert held / 2000 == pytest.approx(0.95, abs=0.015)
    assert np.isnan(held_out.half_width_of_ratio(np.ones(1), np.ones(1)))


def test_a_training_writes_a_file_that_computes_what_pytorch_does(own_home):
    said = []
    run = training.trained(settings(), BAYER, said.append)
    recipe = training.recipe_text(run.settings, BAYER)
    result = finish.finished(run, recipe, said.append)
    assert result.difference <= export.AGREEMENT
    session = open_session(result.model, feature="a test")
    stated = json.loads(session.metadata["isethdr"])
    assert stated["cfa"] == "RG/GB" and stated["captures"] == "merged"
    assert [point["lux"] for point in stated["calibration"]] == [r["lux"] for r in result.rows]
    card = yaml.safe_load((run.folder / "card.yaml").read_text())
    assert card["file"]["recipe_sha256"] == stated["recipe"] == training.recipe_hash(recipe)
    assert card["effort"]["steps"] == 6 and card["loss"]["kind"] == "electrons"
    assert (run.folder / "curves.csv").read_text().count("\n") == 1 + len(run.progress.history)
    with pytest.raises(ConfigError, match="other settings \\(seed=0\\)"):
        training.trained(settings(seed=1), BAYER, said.append)


def test_a_state_of_another_version_is_one_clear_error(own_home):
    training.trained(settings(name="old", steps=2), BAYER, lambda line: None)
    path = own_home / "training" / "pictures" / "old" / training.STATE
    state = training.load_state(path)
    del state["weights"]["floor_limit"]
    training.save_state(path, state)
    with pytest.raises(ConfigError, match="another version of isethdr.*type name=old_2"):
        training.trained(settings(name="old", steps=2), BAYER, lambda line: None)


def test_a_wrong_mean_luminance_is_said():
    def rows(error, half):
        return [
            {"lux": 0.1, "mean_error_percent": 1.0, "half_width_percent": 0.5},
            {"lux": 3.0, "mean_error_percent": error, "half_width_percent": half},
        ]

    assert finish.wrong_mean({"dead leaves": rows(9.0, 2.0)}) == ""
    assert finish.wrong_mean({"dead leaves": rows(-12.0, 3.0)}) == ""
    said = finish.wrong_mean({"dead leaves": rows(2.0, 1.0), "roads": rows(-14.0, 3.0)})
    assert "of roads at 3 lux is wrong by -14 +- 3 %; expected at most 10 %" in said
    # patches that differ a lot: the mean of all may be right by chance
    assert "-48 +- 107 %" in finish.wrong_mean({"dead leaves": rows(-48.0, 107.0)})
    assert finish.longer(settings(steps=4).length()) == "steps=1000"
    assert finish.longer(Settings(minutes=30).length()) == "minutes=60"


def test_ctrl_c_after_the_last_step_says_how_to_continue(own_home, monkeypatch, capsys):
    def stop(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(finish, "calibrate", stop)
    typed = [*BAYER, *(f"{key}={value}" for key, value in TINY.items()), "steps=2"]
    assert action.train_picture(typed) == action.INTERRUPTED
    assert capsys.readouterr().err == "interrupted; type the same command again to continue\n"


def test_a_gpu_that_is_missing_is_one_clear_error(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ConfigError, match="no GPU.*type device=auto"):
        training.trained(settings(device="cuda"), BAYER, lambda line: None)


def test_a_training_that_was_stopped_ends_as_one_that_was_not(own_home):
    whole = training.trained(settings(name="whole", steps=8), BAYER, lambda line: None)
    wanted = settings(name="parts", steps=8)

    def stop(line):
        if line.startswith("step") and not (own_home / "stopped").exists():
            (own_home / "stopped").touch()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        training.trained(wanted, BAYER, stop)
    said = []
    parts = training.trained(wanted, BAYER, said.append)
    assert said[0].startswith("continues after step")
    for name, value in whole.progress.network.state_dict().items():
        assert torch.equal(value, parts.progress.network.state_dict()[name]), name


def test_a_full_disk_is_one_error_and_keeps_the_state(own_home, monkeypatch):
    def full(path, state):
        raise CatalogError(f"cannot write {path}: No space left on device")

    monkeypatch.setattr(training, "save_state", full)
    with pytest.raises(CatalogError, match="No space left"):
        training.trained(settings(steps=2), BAYER, lambda line: None)


def test_it_stops_where_held_out_pictures_stop_improving(own_home, monkeypatch):
    losses = iter([3.0, 2.0, 2.1, 2.2, 2.3, 2.4])
    monkeypatch.setattr(training, "loss_on", lambda network, pictures: next(losses))
    wanted = settings(steps=6, checks=6, patience=2)
    run = training.trained(wanted, BAYER, lambda line: None)
    assert run.progress.clock.step == 4 and "did not improve over 2 checks" in run.progress.stopped
    assert run.progress.best["step"] == 2
    network, weights = training.final_network(run)
    assert "step 2" in weights
    for name, value in network.state_dict().items():
        assert torch.equal(value, run.progress.best["weights"][name]), name


def test_captures_apart_are_joined_by_the_network():
    split = camera_of(["sensor=typical_split_pixel"], "apart")
    assert split.planes == 3 and split.contract().captures == split.captures
    network = choice.network_of(split, "unet", "small").eval()
    inputs = export.example(split, 32, 48, seed=0)
    assert inputs[0].shape == (1, 3, 32, 48)
    xyz, variance = network(*inputs)
    assert xyz.shape == variance.shape == (1, 3, 32, 48)
    # before training, captures of uniform light give that light, except at the border
    flat = [torch.full((1, 3, 32, 48), 400.0), *(torch.ones_like(one) for one in inputs[1:])]
    flat[2] = inputs[2]  # masks
    assert torch.allclose(network(*flat)[0][..., 8:-8, 8:-8], torch.tensor(400.0), rtol=1e-4)


@pytest.mark.slow
def test_a_network_that_joins_captures_is_trained_written_and_run(own_home):
    """The test goes from settings to a picture of a shot with all captures. Six steps of training
    say nothing about quality.
    """
    typed = ["sensor=split_pixel"]
    run = training.trained(settings(captures="apart"), typed, lambda line: None)
    recipe = training.recipe_text(run.settings, typed)
    result = finish.finished(run, recipe, lambda line: None)
    assert result.difference <= export.AGREEMENT
    session = open_session(result.model, feature="a test")
    names = list(camera_of(typed).captures)
    assert len(names) > 1 and json.loads(session.metadata["isethdr"])["captures"] == names
    isp = build("isp", "network", model=str(result.model))
    sensor = build("sensor", "split_pixel", rows=SIDE, columns=SIDE)
    isp.check_shot(sensor.shot_form())
    scene = build("scene", "uniform", width=SIDE, height=SIDE, luminance_cd_m2=20.0)()
    mixed = build("lighting", "ideal")(scene)
    focal_mm = SIDE * 1e-3 * sensor.pitch_um / mixed.attrs["field_width"]
    light = build("lens", "ideal", focal_length_mm=focal_mm, falloff="none")(mixed)
    picture = isp(sensor(light, generator(1)))
    assert picture.xyz.shape == (SIDE, SIDE, 3) and np.isfinite(picture.xyz.values).all()
    assert picture.valid.values.all()


def test_a_view_loss_is_said_in_the_card(own_home):
    run = training.trained(settings(loss="view", steps=2), BAYER, lambda line: None)
    rows = held_out.rows_of(run.progress.network, run.judge)
    recipe = json.loads(training.recipe_text(run.settings, BAYER))
    assert "is biased" in finish.sections_of(run, recipe, "", {"roads": rows})["loss"]["formula"]
