"""Training of a detector from random weights, for a given time. It can continue after an
interruption.
"""

from __future__ import annotations

import json
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
from ..state import check_roads, load_state, save_state
from ..torch_library import device_name, nn, torch
from .loss import loss_of
from .network import DetectorNetwork
from .patches import batch
from .pictures import Data, LabelledPicture, data_of
from .settings import FREE, FREE_OVERRIDES, Settings

STATE = "state.pt"
DECAY = 1e-4  # weight decay of AdamW, per step and learning rate
LARGEST_GRADIENT = 5.0  # largest norm of a gradient; larger gradients are scaled down to it
SAVED_EVERY_S = 60.0  # time between two writes of the state
HELD_BATCHES = 8  # number of batches of held-out pictures
CURVES = {"loss": "training loss", "held_out": "held-out loss"}


@dataclass
class Progress:
    """The state of a training that changes."""

    network: DetectorNetwork
    optimiser: torch.optim.Optimizer
    clock: Clock
    best: dict[str, Any]  # held-out loss, step, number of the check and weights
    history: list[dict[str, Any]]
    roads: list[str]  # the roads of all pictures
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
            "best": self.best,
            "history": self.history,
            "roads": self.roads,
            "stopped": self.stopped,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Set the state to a stored one."""
        self.network.load_state_dict(state["weights"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.clock.step = state["step"]
        self.clock.seconds_before = state["seconds"]
        self.best = state["best"]
        self.history = state["history"]
        self.stopped = state["stopped"]


@dataclass(frozen=True, eq=False)
class Trained:
    """A finished training."""

    folder: Path
    settings: Settings
    data: Data
    progress: Progress
    device: str


def trained(settings: Settings, overrides: Sequence[str], tell: Callable[[str], None]) -> Trained:
    """Return a detector trained on a dataset, to its length or until held-out roads stop improving.

    Parameters
    ----------
    settings : settings of the training.
    overrides : overrides of the config, as typed.
    tell : called with each line of text about the progress.

    Raises
    ------
    ConfigError : a setting or an override has a mistake, or another training has the name.
    CatalogError : there is no such dataset, or the state cannot be written.
    """
    recipe = recipe_text(settings, overrides)
    check_recipe(folder_of(settings), recipe)
    data = data_of(settings, overrides, tell)
    return trained_on(data, settings, recipe, tell)


def trained_on(data: Data, settings: Settings, recipe: str, tell: Callable[[str], None]) -> Trained:
    """Return a detector trained on pictures.

    Parameters
    ----------
    data : pictures for training, and held-out ones.
    settings : settings of the training.
    recipe : text of everything that determines the result; a stored state with another recipe is
        refused.
    tell : called with a line of text at each check.

    Raises
    ------
    ConfigError : another training has the name, or the dataset has changed since it began.
    CatalogError : the state cannot be written. The stored state is kept.
    """
    if settings.threads:
        torch.set_num_threads(settings.threads)
    folder = folder_of(settings)
    state = check_recipe(folder, recipe)
    device = device_name(settings.device)
    torch.manual_seed(settings.seed)
    network = DetectorNetwork(settings.size).to(device, memory_format=torch.channels_last)
    adam = torch.optim.AdamW(network.parameters(), settings.rate, weight_decay=DECAY)
    progress = Progress(network, adam, Clock(settings.length()), {}, [], data.roads)
    if state is not None:
        check_roads(folder, settings.dataset, state.get("roads", data.roads), data.roads)
        progress.restore(state)
        tell(f"continues after step {progress.clock.step}")
    run = Trained(folder, settings, data, progress, device)
    _loop(run, recipe, tell)
    return run


def check_recipe(folder: Path, recipe: str) -> dict[str, Any] | None:
    """Return the stored state of a training; None if there is none.

    Parameters
    ----------
    folder : folder of the training.
    recipe : text of the recipe.

    Raises
    ------
    ConfigError : the state belongs to a training with other settings.
    """
    state = load_state(folder / STATE)
    if state is None or state["recipe"] == recipe:
        return state
    old = json.loads(state["recipe"])
    new = json.loads(recipe)
    differing = [f"{k}={old.get(k)}" for k in sorted({*old, *new}) if old.get(k) != new.get(k)]
    raise ConfigError(
        f"the training {folder.name} has other settings ({', '.join(differing)}); expected the"
        f" same, or another name; type for example name={folder.name}_2"
    )


def _loop(run: Trained, recipe: str, tell: Callable[[str], None]) -> None:
    """Train until the end. The state is stored once a minute, at the end, and on Ctrl-C."""
    progress = run.progress
    clock = progress.clock
    settings = run.settings
    path = run.folder / STATE
    held = [
        _batch(run, run.data.held_out, (settings.seed, 1, k)).result() for k in range(HELD_BATCHES)
    ]
    saved = clock.seconds()
    losses: list[float] = []
    batches = _batch(run, run.data.training, (settings.seed, 0, clock.step))
    try:
        with between_steps() as stop_if_typed:
            while clock.share() < 1 and not progress.stopped:
                now = batches.result()
                batches = _batch(run, run.data.training, (settings.seed, 0, clock.step + 1))
                losses.append(_step(run, now, settings.rate * clock.rate_factor()))
                clock.step += 1
                if clock.share() * settings.checks >= len(progress.history) + 1:
                    _check(run, held, losses, tell)
                    losses = []
                if clock.seconds() - saved > SAVED_EVERY_S:
                    save_state(path, progress.state(recipe))
                    saved = clock.seconds()
                stop_if_typed()
    except KeyboardInterrupt:
        save_state(path, progress.state(recipe))
        raise
    if losses or not progress.history:
        _check(run, held, losses, tell)
    save_state(path, progress.state(recipe))


_MAKER = ThreadPoolExecutor(1)  # makes the next batch while the network learns from this one


def _batch(
    run: Trained, pictures: Sequence[LabelledPicture], key: tuple[int, ...]
) -> Future[tuple[np.ndarray, ...]]:
    """Return the batch of a key. It depends on the key alone, not on earlier batches."""
    settings = run.settings
    random = np.random.default_rng(key)
    return _MAKER.submit(batch, pictures, settings.batch, settings.patch_px, random)


def _step(run: Trained, arrays: tuple[np.ndarray, ...], rate: float) -> float:
    """Change the weights by one step, and return its loss."""
    progress = run.progress
    progress.network.train()
    for group in progress.optimiser.param_groups:
        group["lr"] = rate
    loss = _loss(run, arrays)
    progress.optimiser.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(progress.network.parameters(), LARGEST_GRADIENT)
    progress.optimiser.step()
    return float(loss.detach())


def _loss(run: Trained, arrays: tuple[np.ndarray, ...]) -> torch.Tensor:
    rgb, *targets = (torch.from_numpy(v).to(run.device) for v in arrays)
    half = half_precision(run.settings.precision, run.device)
    with torch.autocast(run.device.split(":")[0], torch.bfloat16, enabled=half):
        logits, logs = run.progress.network(rgb.contiguous(memory_format=torch.channels_last))
    return loss_of(logits.float(), logs.float(), tuple(targets))


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


def _check(
    run: Trained,
    held: Sequence[tuple[np.ndarray, ...]],
    losses: Sequence[float],
    tell: Callable[[str], None],
) -> None:
    """Add a row to the curves, keep the best weights, and stop the training if nothing improves."""
    progress = run.progress
    progress.network.eval()
    with torch.no_grad():
        held_out = float(np.mean([float(_loss(run, arrays)) for arrays in held]))
    minutes = progress.clock.seconds() / 60
    loss = float(np.mean(losses)) if losses else held_out
    row = {"step": progress.clock.step, "minutes": round(minutes, 3), "loss": loss}
    progress.history.append({**row, "held_out": held_out})
    if not progress.best or held_out < progress.best["held_out"]:
        weights = {k: v.cpu().clone() for k, v in progress.network.state_dict().items()}
        check = len(progress.history)
        progress.best = {**row, "held_out": held_out, "check": check, "weights": weights}
    tell(f"step {row['step']}, {minutes:.1f} min: loss {loss:.3f}, held out {held_out:.3f}")
    if len(progress.history) - progress.best["check"] >= run.settings.patience:
        progress.stopped = f"held-out roads did not improve over {run.settings.patience} checks"
    run.folder.mkdir(parents=True, exist_ok=True)
    write_curves(run.folder, progress.history, CURVES)


def folder_of(settings: Settings) -> Path:
    """Return the folder of a training."""
    return home() / "training" / "detectors" / settings.folder_name


def recipe_text(settings: Settings, overrides: Sequence[str]) -> str:
    """Return everything that determines the result, as JSON.

    Parameters
    ----------
    settings : settings of the training.
    overrides : overrides of the config, as typed.
    """
    decides = {k: v for k, v in asdict(settings).items() if k not in FREE}
    kept = sorted(one for one in overrides if one.partition("=")[0] not in FREE_OVERRIDES)
    return json.dumps({**decides, "overrides": kept}, sort_keys=True)
