"""Reach: the largest distance from an output pixel to an input pixel that it depends on."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from isethdr_core.onnx_session import OnnxSession

from .contract import Contract
from .running import fixed_size

SIDE_PX = 256  # side of the test picture; a reach of less than half of it can be measured
LEVEL_E = 100.0  # mean of the test picture
NOISE_E = 2.0  # value of the input `noise`
# factors on the changed sample; two, because the network may not respond to one of them
FACTORS = (0.0, 4.0)
MOST_PLACES = 8  # largest number of changed samples


def probe(session: OnnxSession, contract: Contract) -> dict[str, np.ndarray]:
    """Return inputs (1, plane, y, x) of a grey field with noise, for `measured_reach_px`."""
    multiple = contract.multiple_px
    rows, columns = fixed_size(session) or 2 * (-(-SIDE_PX // multiple) * multiple,)
    generator = np.random.default_rng(0)
    raw = generator.poisson(LEVEL_E, (1, contract.planes, rows, columns)).astype(np.float32)
    cell = contract.cell
    letters = np.tile(cell, (-(-rows // cell.shape[0]), -(-columns // cell.shape[1])))
    letters = letters[:rows, :columns]
    masks = np.array([letters == channel for channel in contract.channels], np.float32)[None]
    every = {
        "raw": raw,
        "noise": np.full_like(raw, NOISE_E),
        "masks": masks,
        "valid": np.ones_like(raw),
    }
    wanted = {port.name for port in session.inputs}
    return {name: plane for name, plane in every.items() if name in wanted}


def measured_reach_px(
    session: OnnxSession, planes: Mapping[str, np.ndarray], changed: str = "raw", step: int = 8
) -> float:
    """Return the reach of a model, pixels; inf if it is about half of the picture or more.

    One sample near the middle of a noisy picture is changed, in turn for up to `step` neighbouring
    samples on a diagonal. The reach is the largest distance from the sample to an output that
    changes. If the network does not respond to any of these changes, the result is too small.

    Parameters
    ----------
    session : the open model.
    planes : every input (1, plane, y, x) by name.
    changed : name of the input in which a sample is changed.
    step : number of changed samples, at most `MOST_PLACES`: the period of the model's strides.
    """
    rows, columns = planes[changed].shape[2:]
    usual = session.run(planes)
    reach = 0
    places = min(step, MOST_PLACES)
    for place in range(places):
        y = rows // 2 + place
        x = columns // 2 + place
        for factor in FACTORS:
            samples = planes[changed].copy()
            samples[..., y, x] *= factor
            seen = session.run({**planes, changed: samples})
            for name, values in seen.items():
                differ_y, differ_x = np.nonzero((values != usual[name]).any(axis=(0, 1)))
                if differ_y.size:
                    away = max(np.abs(differ_y - y).max(), np.abs(differ_x - x).max())
                    reach = max(reach, int(away))
    told = min(rows, columns) // 2 - places
    return math.inf if reach >= told else float(reach)
