"""Published layout: a model with planes as input and output, like those of the ISETHDR paper.

The model has one input of 3 planes (R, G, B) or 4 (and W), and one output with the same number of
planes. A plane has the samples of its channel. Its other sites are filled with uniform noise of 0
to 0.001, as in the paper. The samples are scaled so that the brightest is 0.95, and the output is
scaled back (`ipComputeNN.m`). The output planes are electrons of the channels. The colour matrix of
the other isps follows.

The file states no unit, filter array or variance. The ledger states the assumptions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import OnnxSession, shape_text
from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.truth import VARIANCE_KNOWN

from ..demosaic.interpolation import array_period
from ..develop import PictureNoise, finish, picture_attrs, solve_matrix
from ..development_fields import Development
from ..spectra import Illuminant
from .fields import NetworkFields
from .reach import measured_reach_px
from .running import Cut, fixed_size, results_of
from .samples import near_invalid, shot

LETTERS = "RGBW"  # channels of the planes, in their order
BRIGHTEST = 0.95  # largest sample after scaling
FILL = 0.001  # largest value of the noise at sites of other channels
FILL_SEED = 0  # fixed seed, because the noise is part of the method and the same in every shot
TILE_PX = 512  # side of a tile, as published; unlike the published tiles, tiles overlap here
MULTIPLE_PX = 8  # rows and columns of a tile are multiples of this number


def is_published(session: OnnxSession) -> bool:
    """Return whether a model has the published layout."""
    if len(session.inputs) != 1 or len(session.outputs) != 1:
        return False
    [port] = session.inputs
    [result] = session.outputs
    return (
        port.name != "raw"
        and len(port.shape) == len(result.shape) == 4
        and port.shape[1] in (3, 4)
        and result.shape[1] in (port.shape[1], None)
        and port.type == "tensor(float)"
    )


@dataclass(frozen=True, eq=False)
class PublishedModel:
    """A model file in the published layout."""

    session: OnnxSession

    @property
    def channels(self) -> str:
        """Letters of the planes."""
        return LETTERS[: self.session.inputs[0].shape[1]]

    @cached_property
    def reach_px(self) -> float:
        """Largest distance from an output to an input that it depends on, measured, pixels."""
        [port] = self.session.inputs
        rows, columns = fixed_size(self.session) or (TILE_PX // 2, TILE_PX // 2)
        generator = np.random.default_rng(FILL_SEED)
        grey = generator.uniform(0.0, 0.5, (1, len(self.channels), rows, columns))
        return measured_reach_px(self.session, {port.name: grey.astype(np.float32)}, port.name)

    def check_form(self, form: ShotForm) -> None:
        """Raise ConfigError unless the sensor has the filters of the planes."""
        letters = set("".join(form.filters))
        if letters != set(self.channels):
            raise ConfigError(
                f"{self.session.path} takes {len(self.channels)} planes, of the filters"
                f" {', '.join(self.channels)}; the sensor has {', '.join(sorted(letters))};"
                " expected the same filters; choose another sensor, or a model with"
                f" {shape_text((1, len(letters), None, None))}"
            )

    def picture(self, captures: xr.Dataset, how: NetworkFields, balance: Illuminant) -> xr.Dataset:
        """Return the picture of captures with a known black level. It states no variance.

        Parameters
        ----------
        captures : captures Dataset with a known black level.
        how : the fields of `isp=network`.
        balance : light in which grey is reproduced exactly; views show its white as white.
        """
        taken = shot(captures, how, apart=False)
        self.check_form(taken.form())
        planes, scale = self._planes(taken.planes.signal_e[0], taken.filters, taken.channels)
        [port] = self.session.inputs
        [result] = self.session.outputs
        cell = array_period(taken.filters)
        multiple = int(np.lcm.reduce([MULTIPLE_PX, *cell]))
        size = fixed_size(self.session) or (-(-TILE_PX // multiple) * multiple,) * 2
        cut = Cut(cell, multiple, self.reach_px, size)
        seen = results_of(self.session, {port.name: planes}, (0, 0), cut, how.tile_px)
        of_channel = [self.channels.index(name) for name in taken.channels]
        electrons = seen[result.name].astype(float)[of_channel] / scale
        _state_assumptions()
        matrix = solve_matrix(
            taken.read.response,
            captures.wavelength.values,
            balance,
            how.design_snr,
            taken.dark_var_e2,
        )
        development = Development(balance=how.balance, design_snr=how.design_snr)
        attrs = picture_attrs(
            captures, taken.read.response, development, balance, taken.dark_var_e2
        )
        attrs[VARIANCE_KNOWN] = False
        unknown = PictureNoise(*np.broadcast_to(np.nan, (2, 3, *taken.filters.shape)))
        valid = ~near_invalid(taken.invalid(), cell)
        return finish(matrix, electrons, unknown, valid, captures, attrs)

    def _planes(
        self, signal_e: np.ndarray, filters: np.ndarray, channels: tuple[str, ...]
    ) -> tuple[np.ndarray, float]:
        """Return the input planes (plane, y, x) of a mosaic of electrons, and the scale: their
        value per electron.
        """
        brightest = float(signal_e.max())
        scale = BRIGHTEST / brightest if brightest > 0 else 1.0
        number = np.array([self.channels.index(name) for name in channels])[filters]
        generator = np.random.default_rng(FILL_SEED)
        planes = generator.uniform(0.0, FILL, (len(self.channels), *filters.shape))
        # values below 0 become 0, because the model was trained on volts, which are never negative
        volts = np.maximum(signal_e * scale, 0.0)
        own = number == np.arange(len(self.channels))[:, None, None]
        return np.where(own, volts, planes).astype(np.float32), scale


def _state_assumptions() -> None:
    """State in the ledger the assumptions on what the file does not state."""
    ledger.left_out(
        "variance of isp network",
        "a model in the published layout states none",
        np.nan,
        "",
        key="variance",
    )
    ledger.left_out(
        "unit of the model's planes",
        f"the file states none; assumed: the brightest sample is {BRIGHTEST:g}, noise of 0 to"
        f" {FILL:g} fills the sites of other channels, and outputs have the scale of the inputs",
        np.nan,
        "",
        key="unit",
    )
    ledger.left_out(
        "electrons below 0",
        "a model in the published layout takes volts, which end at 0: dark areas are too bright by"
        " up to 0.4 of their noise",
        np.nan,
        "",
        key="clipped",
    )
