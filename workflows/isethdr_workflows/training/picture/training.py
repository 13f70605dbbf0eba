"""Training of a picture network from random weights, on simulated data."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.storage.home_folder import home

from ..clock import Clock
from ..curves import write_curves
from ..interrupts import between_steps
from ..state import check_roads, check_weights, load_state, save_state
from ..torch_library import device_name, nn, torch
from .camera import TrainingCamera, camera_of
from .held_out import HeldOut, held_out, loss_on
from .leaves import WAVELENGTH_NM
from .linear_fit import fit
from .loss import Batch, loss_of
from .networks.choice import network_of
from .networks.linear_start import LinearStart
from .networks.picture_network import PictureNetwork
from .settings import FREE, Settings
from .sheets import LUX, SHEET, Sheets, brightest_lux, dark_noise_e2
from .sources import Data, data_of

STATE = "state.pt"
MODEL = "model.onnx"
DECAY = 1e-4  # weight decay of AdamW, per step and learning rate
LARGEST_GRADIENT = 1.0  # largest norm of a gradient; larger gradients are scaled down to it
AVERAGED_FROM = 0.6  # share of the training after which the mean of weights begins
AVERAGE = 0.998  # share of the old mean that each step keeps
SAVED_EVERY_S = 60.0  # time between two writes of the state
MOST_MAKERS = 8  # largest number of threads that make sheets for a GPU
HELD_OUT_SEED = 2017  # seed of places, light and noise of held-out sheets, for every training
CURVES = {"loss": "training loss", "held_out": "held-out loss"}


@dataclass
class Progress:
    """The state of a training that changes."""

    network: PictureNetwork
    optimiser: torch.optim.Optimizer
    average: dict[str, torch.Tensor]  # mean of weights; empty before it begins
    best: dict[str, Any]  # held-out loss, step and weights of the best check
    history: list[dict[str, Any]]
    clock: Clock
    roads: list[str]  # the stores of all rendered roads
    stopped: str = ""  # why it ended before its length

    def state(self, recipe: str) -> dict[str, Any]:
        """Return everything that is needed to continue.

        Parameters
        ----------
        recipe : text of the recipe.
        """
        return {
            "recipe": recipe,
            "step": self.clock.step,
            "seconds": self.clock.seconds(),
            "weights": self.network.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "average": self.average,
            "best": self.best,
            "history": self.history,
            "roads": self.roads,
            "stopped": self.stopped,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Set the state to a stored one."""
        self.network.load_state_dict(state["weights"])
        self.optimiser.load_state_dict(state["optimiser"])
        device = next(self.network.parameters()).device
        self.average = {name: value.to(device) for name, value in state["average"].items()}
        self.best = state["best"]
        self.history = state["history"]
        self.clock.step = state["step"]
        self.clock.seconds_before = state["seconds"]
        self.stopped = state["stopped"]


@dataclass(frozen=True, eq=False)
class Trained:
    """A finished training."""

    folder: Path
    settings: Settings
    camera: TrainingCamera
    data: Data
    held_out_sheets: dict[str, Sheets]  # sheets of held-out pictures by source
    brightest_lux: float  # largest illuminance that the camera can measure
    pictures: dict[str, HeldOut]  # patches that stop the training and calibrate, by source
    progress: Progress
    device: str

    @property
    def judge(self) -> HeldOut:
        """The held-out pictures that decide when to stop: those of roads, if there are any."""
        return list(self.pictures.values())[-1]


def trained(settings: Settings, overrides: Sequence[str], tell: Callable[[str], None]) -> Trained:
    """Return a network trained to its length, or until held-out pictures stop improving.

    Parameters
    ----------
    settings : settings of the training.
    overrides : overrides of the config, for the sensor and the lens.
    tell : called with a line of text at each check.

    Raises
    ------
    ConfigError : a setting or an override has a mistake, another training has the name, or the
        dataset has changed since the training began.
    CatalogError : the state cannot be written. The stored state is kept.
    """
    if settings.threads:
        torch.set_num_threads(settings.threads)
    device = device_name(settings.device)
    camera = camera_of(overrides, settings.captures)
    folder = folder_of(settings, camera)
    recipe = recipe_text(settings, overrides)
    state = load_state(folder / STATE)
    if state is not None and state["recipe"] != recipe:
        raise ConfigError(
            f"the training {folder.name} has other settings ({differing(state['recipe'], recipe)});"
            f" expected the same, or another name; type for example name={folder.name}_2"
        )
    data = data_of(settings, camera, overrides)
    top_lux = brightest_lux(camera, WAVELENGTH_NM)
    sheets = Sheets(camera, data.training, settings.patch_px, settings.seed, (LUX[0], top_lux))
    held_out_sheets = {
        source.name: Sheets(camera, (source,), settings.patch_px, HELD_OUT_SEED)
        for source in data.held_out
    }
    pictures = {
        name: held_out(sheets_of, top_lux, device) for name, sheets_of in held_out_sheets.items()
    }
    torch.manual_seed(settings.seed)
    network = network_of(camera, settings.network, settings.size, settings.start)
    if state is None:
        network.limit_floor(dark_noise_e2(camera, WAVELENGTH_NM))
        if isinstance(network.start, LinearStart):
            fit(network.start, sheets)
    network = network.to(device, memory_format=torch.channels_last)
    adam = torch.optim.AdamW(network.parameters(), settings.rate, weight_decay=DECAY)
    progress = Progress(network, adam, {}, {}, [], Clock(settings.length()), data.roads)
    if state is not None:
        check_roads(folder, settings.dataset, state.get("roads", data.roads), data.roads)
        check_weights(folder, state["weights"], network.state_dict())
        progress.restore(state)
        tell(f"continues after step {progress.clock.step}")
    run = Trained(
        folder, settings, camera, data, held_out_sheets, top_lux, pictures, progress, device
    )
    _loop(run, sheets, recipe, tell)
    return run


def _loop(run: Trained, sheets: Sheets, recipe: str, tell: Callable[[str], None]) -> None:
    """Train until the end. The state is stored about once a minute, at the end, and on Ctrl-C."""
    progress = run.progress
    clock = progress.clock
    path = run.folder / STATE
    saved = clock.seconds()
    losses: list[torch.Tensor] = []
    masks = run.judge.masks
    batches = Batches(sheets, run.settings.batch, run.device)
    try:
        with between_steps() as stop_if_typed:
            while clock.share() < 1 and not progress.stopped:
                rate = run.settings.rate * clock.rate_factor()
                losses.append(_step(run, batches.of(clock.step), masks, rate))
                clock.step += 1
                if _is_check(run):
                    _check(run, float(torch.stack(losses).mean()), tell)
                    losses.clear()
                    saved = -SAVED_EVERY_S
                if clock.seconds() - saved > SAVED_EVERY_S:
                    save_state(path, progress.state(recipe))
                    saved = clock.seconds()
                stop_if_typed()
    except KeyboardInterrupt:
        save_state(path, progress.state(recipe))
        raise
    finally:
        batches.close()
    if losses or not progress.history:
        _check(run, float(torch.stack(losses).mean()) if losses else 0.0, tell)
    save_state(path, progress.state(recipe))


class Batches:
    """The batches of a training. A batch has one patch of each of several sheets, which differ in
    light. The next sheets are made while the present ones are used.
    """

    def __init__(self, sheets: Sheets, size: int, device: str) -> None:
        self.sheets = sheets
        self.size = size
        self.device = device
        # a GPU would wait for sheets, so several threads make them; a CPU that trains has no
        # threads to spare
        makers = min(os.cpu_count() or 1, MOST_MAKERS) if device.startswith("cuda") else 1
        self.maker = ThreadPoolExecutor(makers)
        self.made: dict[int, list[Future[Any]]] = {}

    def of(self, step: int) -> Batch:
        """Return the batch of a step. It depends on the step alone, not on earlier batches."""
        group, part = divmod(step, SHEET)
        for wanted in (group, group + 1):
            if wanted not in self.made:
                numbers = range(wanted * self.size, (wanted + 1) * self.size)
                self.made[wanted] = [self.maker.submit(self.sheets.sheet, k) for k in numbers]
        for old in [key for key in self.made if key < group]:
            del self.made[old]
        sheets = [made.result() for made in self.made[group]]
        together = (np.stack(planes) for planes in zip(*([v[part] for v in s] for s in sheets)))
        return Batch(*(torch.from_numpy(planes).to(self.device) for planes in together))

    def close(self) -> None:
        """Stop making sheets."""
        self.maker.shutdown(wait=False, cancel_futures=True)


def _step(run: Trained, batch: Batch, masks: torch.Tensor, rate: float) -> torch.Tensor:
    """Change the weights by one step, and return its loss."""
    progress = run.progress
    network = progress.network
    network.train()
    network.half_precision = half_precision(run.settings.precision, run.device)
    for group in progress.optimiser.param_groups:
        group["lr"] = rate
    xyz, variance = network(batch.raw, batch.noise, masks, batch.valid)
    loss = loss_of(run.settings.loss, xyz, variance, batch)
    progress.optimiser.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(network.parameters(), LARGEST_GRADIENT)
    progress.optimiser.step()
    if progress.clock.share() >= AVERAGED_FROM:
        _average(progress)
    return loss.detach()


@torch.no_grad()
def _average(progress: Progress) -> None:
    weights = progress.network.state_dict()
    if not progress.average:
        progress.average = {name: value.clone() for name, value in weights.items()}
        return
    for name, value in weights.items():
        progress.average[name].lerp_(value, 1 - AVERAGE)


def half_precision(wanted: str, device: str) -> bool:
    """Return whether a training computes in bfloat16.

    Parameters
    ----------
    wanted : `bfloat16`, `float32` or `auto`, which takes bfloat16 if the processor multiplies such
        matrices.
    device : device of PyTorch.
    """
    if wanted != "auto":
        return wanted == "bfloat16"
    return device.startswith("cuda") or bool(torch.cpu.get_capabilities().get("amx_bf16"))


def _is_check(run: Trained) -> bool:
    """Return whether one more of the evenly spaced checks is due."""
    return run.progress.clock.share() * run.settings.checks >= len(run.progress.history) + 1


def _check(run: Trained, loss: float, tell: Callable[[str], None]) -> None:
    """Add a row to the curves, and stop the training if held-out pictures no longer improve."""
    progress = run.progress
    network = progress.network.eval()
    network.half_precision = False
    held = loss_on(network, run.judge)
    minutes = progress.clock.seconds() / 60
    row = {"step": progress.clock.step, "minutes": round(minutes, 3), "loss": loss}
    progress.history.append({**row, "held_out": held})
    if not progress.best or held < progress.best["held_out"]:
        weights = {name: value.clone() for name, value in network.state_dict().items()}
        check = len(progress.history)
        progress.best = {**row, "held_out": held, "check": check, "weights": weights}
    tell(f"step {row['step']}, {minutes:.1f} min: loss {loss:.4f}, held out {held:.4f}")
    if len(progress.history) - progress.best["check"] >= run.settings.patience:
        progress.stopped = (
            f"held-out pictures did not improve over {run.settings.patience} checks; the weights"
            f" of step {progress.best['step']} are kept"
        )
    run.folder.mkdir(parents=True, exist_ok=True)
    write_curves(run.folder, progress.history, CURVES)


def final_network(run: Trained) -> tuple[PictureNetwork, str]:
    """Return the network with its final weights, and a description of them. They are the mean over
    the last steps, or the weights of the best check if these are better on held-out pictures.
    """
    progress = run.progress
    network = progress.network.eval()
    network.half_precision = False
    chosen = f"of the best check, step {progress.best['step']}"
    if progress.average and not progress.stopped:
        network.load_state_dict(progress.average)
        if loss_on(network, run.judge) <= progress.best["held_out"]:
            return network, f"mean of the last steps, {AVERAGE:g} of it kept by each"
    network.load_state_dict(progress.best["weights"])
    return network, chosen


def folder_of(settings: Settings, camera: TrainingCamera) -> Path:
    """Return the folder of a training.

    Parameters
    ----------
    settings : settings of the training.
    camera : camera of the training.
    """
    name = settings.name or f"{camera.name}_{settings.network}_{settings.size}"
    return home() / "training" / "pictures" / name


def recipe_text(settings: Settings, overrides: Sequence[str]) -> str:
    """Return everything that determines the result, as JSON.

    Parameters
    ----------
    settings : settings of the training.
    overrides : overrides of the config, as typed.
    """
    decides = {k: v for k, v in asdict(settings).items() if k not in FREE}
    return json.dumps({**decides, "overrides": sorted(overrides)}, sort_keys=True)


def recipe_hash(recipe: str) -> str:
    """Return the SHA-256 of a recipe."""
    return hashlib.sha256(recipe.encode()).hexdigest()


def differing(stored: str, wanted: str) -> str:
    """Return the settings in which two recipes differ, with the values of the stored one.

    Parameters
    ----------
    stored, wanted : texts of the two recipes.
    """
    old = json.loads(stored)
    new = json.loads(wanted)
    keys = sorted(key for key in {*old, *new} if old.get(key) != new.get(key))
    return ", ".join(f"{key}={old.get(key)}" for key in keys)
