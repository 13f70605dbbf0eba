"""Export: a trained network as an ONNX file for `isp=network`, checked against PyTorch."""

from __future__ import annotations

import json
import logging
import math
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_isp.network.contract import KEY, VERSION, Contract

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import open_session

from ..files import write_file
from ..onnx_notes import remove_notes
from ..torch_library import onnx, torch
from .camera import TrainingCamera
from .leaves import WAVELENGTH_NM
from .networks.picture_network import PictureNetwork

INPUTS = ("raw", "noise", "masks", "valid")
OUTPUTS = ("xyz", "variance")
LARGEST_CELLS = 4096  # largest rows and columns of a picture over multiple_px
# largest difference from PyTorch over the largest value; float32 sums have another order
AGREEMENT = 1e-5


def export(
    network: PictureNetwork,
    camera: TrainingCamera,
    path: Path,
    stated: Mapping[str, Any],
) -> float:
    """Write a model file, and return its largest difference from PyTorch, over the largest value.

    Parameters
    ----------
    network : trained and calibrated network.
    camera : camera for which the network was trained.
    path : path of the file, which is replaced completely or not at all.
    stated : description that the file contains, including `multiple_px`.

    Raises
    ------
    ConfigError : the file computes other values than the network.
    CatalogError : the file cannot be written.
    """
    network = network.to("cpu").eval()
    network.half_precision = False
    multiple = int(stated["multiple_px"])
    rows, columns = (
        torch.export.Dim(name, min=2, max=LARGEST_CELLS) * multiple for name in ("rows", "columns")
    )
    sizes = {2: rows, 3: columns}
    with tempfile.TemporaryDirectory() as folder, quiet():
        file = Path(folder) / "model.onnx"
        torch.onnx.export(
            network,
            example(camera, 6 * multiple, 4 * multiple, seed=1),
            file,
            dynamo=True,
            external_data=False,
            verbose=False,
            input_names=list(INPUTS),
            output_names=list(OUTPUTS),
            dynamic_shapes=(sizes, sizes, sizes, sizes),
        )
        model = onnx.load(file)
    remove_notes(model)
    entry = model.metadata_props.add()
    entry.key = KEY
    entry.value = Contract.from_json(json.dumps(dict(stated)), str(path)).to_json()
    write_file(path, [model.SerializeToString()])
    worst = difference(network, path, example(camera, 3 * multiple, 8 * multiple, seed=2))
    if not worst <= AGREEMENT:
        raise ConfigError(
            f"{path} differs from the trained network by {worst:.1e} of the largest value;"
            f" expected at most {AGREEMENT:g}; train again with other versions of torch and"
            " onnxruntime"
        )
    return worst


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress messages of the exporter for its developers within the block."""
    loggers = [logging.getLogger(name) for name in ("torch.onnx", "torch.utils.flop_counter")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def example(camera: TrainingCamera, rows: int, columns: int, seed: int) -> tuple[Any, ...]:
    """Return random inputs of a network, with levels over four decades and some saturated samples.

    Parameters
    ----------
    camera : camera of the network.
    rows, columns : size of the inputs, pixels.
    seed : seed of the values.
    """
    rng = np.random.default_rng(seed)
    shape = 1, camera.planes, rows, columns
    raw = np.exp(rng.uniform(np.log(0.3), np.log(3000.0), shape)) + rng.normal(0, 1, shape)
    noise = np.exp(rng.uniform(-1, 1, shape))
    valid = rng.uniform(size=shape) < 0.95
    masks = camera.masks(rows, columns)[None]
    return tuple(torch.tensor(v, dtype=torch.float32) for v in (raw, noise, masks, valid))


@torch.no_grad()
def difference(network: PictureNetwork, path: Path, inputs: Sequence[Any]) -> float:
    """Return the largest difference between the outputs of a file and of its network, over the
    largest value of each output.

    Parameters
    ----------
    network : network in PyTorch.
    path : ONNX file of the network.
    inputs : inputs of the network, in the order of `INPUTS`.
    """
    session = open_session(path, feature="isethdr train picture")
    theirs = session.run({k: v.numpy() for k, v in zip(INPUTS, inputs, strict=True)})
    ours = dict(zip(OUTPUTS, network(*inputs), strict=True))
    return max(
        float(np.abs(theirs[k] - ours[k].numpy()).max() / np.abs(ours[k].numpy()).max())
        for k in OUTPUTS
    )


def stated_of(camera: TrainingCamera, multiple_px: int, reach_px: float) -> dict[str, Any]:
    """Return the description of the camera in a model file (docs/how-to/network_isp.md).

    Parameters
    ----------
    camera : camera of the network.
    multiple_px : rows and columns of an input are multiples of this number.
    reach_px : distance over which an output depends on samples, pixels; infinite: the whole
        picture.
    """
    response = camera.response(WAVELENGTH_NM)
    efficiency = response.efficiency(np.asarray(WAVELENGTH_NM))
    curves = {
        name: [round(float(v), 6) for v in row]
        for name, row in zip(response.channels, efficiency, strict=True)
        if name in camera.channels
    }
    return {
        "contract": VERSION,
        "cfa": "/".join(camera.cell),
        "channels": list(camera.channels),
        "captures": list(camera.captures) if camera.apart else "merged",
        "unit_channel": camera.unit_channel,
        "multiple_px": multiple_px,
        "reach_px": None if math.isinf(reach_px) else int(reach_px),
        "quantum_efficiency": curves,
        "wavelength_nm": list(WAVELENGTH_NM),
        "sensor": camera.name,
    }
