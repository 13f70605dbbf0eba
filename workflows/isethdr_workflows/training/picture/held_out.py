"""Held-out pictures: loss, mean luminance and stated variance by illuminance, and calibration of
the variance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student_t

from ..torch_library import functional, torch
from .loss import Batch, noise_loss
from .networks.picture_network import PictureNetwork, sample_variance
from .sheets import Sheets

LUX = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
NEW_SHEETS = 16  # number of sheets at each illuminance for the tables of the card
BINS = 10  # number of bins of the local level, for the calibration
# number of rounds of the calibration; between its nodes, each round comes closer to the goal
ROUNDS = 3


class Level(NamedTuple):
    """Held-out patches of one illuminance."""

    lux: float
    patches: Batch


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out patches of all illuminances.

    Parameters
    ----------
    levels : held-out patches by illuminance, darkest first.
    masks : filters of a patch (1, channel, y, x).
    period : period of the filter array, pixels.
    """

    levels: tuple[Level, ...]
    masks: torch.Tensor
    period: int

    def thinned(self) -> HeldOut:
        """Return every second illuminance and every second patch. This is enough to see a training
        improve, in a quarter of the time.
        """
        levels = tuple(
            Level(lux, Batch(*(v[::2] for v in patches))) for lux, patches in self.levels[::2]
        )
        return replace(self, levels=levels)

    def with_others(self, others: Sequence[HeldOut]) -> HeldOut:
        """Return these patches together with others at the same illuminances."""
        levels = tuple(
            Level(
                same[0].lux,
                Batch(*(torch.cat(parts) for parts in zip(*(v.patches for v in same)))),
            )
            for same in zip(self.levels, *(other.levels for other in others), strict=True)
        )
        return replace(self, levels=levels)

    def answers(
        self, network: PictureNetwork
    ) -> Iterator[tuple[float, Batch, torch.Tensor, torch.Tensor]]:
        """Yield illuminance, patches, and the XYZ and variance that a network returns for them."""
        for lux, patches in self.levels:
            parts = [network(p.raw, p.noise, self.masks, p.valid) for p in groups(patches)]
            xyz, variance = (torch.cat([part[k] for part in parts]) for k in (0, 1))
            yield lux, patches, xyz, variance


def groups(patches: Batch) -> list[Batch]:
    """Return patches in groups that fit into memory."""
    return [Batch(*parts) for parts in zip(*(v.split(4) for v in patches))]


def held_out(sheets: Sheets, brightest_lux: float, device: str) -> HeldOut:
    """Return one sheet of patches for each illuminance that the camera can measure. These
    patches decide when a training stops, and calibrate the variance.

    Parameters
    ----------
    sheets : sheets of the held-out pictures.
    brightest_lux : largest illuminance that the camera can measure, lux.
    device : device of PyTorch.
    """
    levels = (
        _level(sheets, lux, number, device) for number, lux in enumerate(_measurable(brightest_lux))
    )
    return HeldOut(tuple(levels), *_filters(sheets, device))


def _measurable(brightest_lux: float) -> list[float]:
    return [lux for lux in LUX if lux <= brightest_lux]


def _level(sheets: Sheets, lux: float, number: int, device: str) -> Level:
    """Return a sheet at one illuminance."""
    patches = replace(sheets, lux=(lux, lux)).sheet(number)
    return Level(lux, Batch(*(torch.from_numpy(v).to(device) for v in patches)))


def _filters(sheets: Sheets, device: str) -> tuple[torch.Tensor, int]:
    """Return the filters of a patch and the period of the filter array."""
    side = sheets.patch_px
    return torch.from_numpy(sheets.camera.masks(side, side))[None].to(device), sheets.camera.period


def measured(patches: Batch, period: int) -> torch.Tensor:
    """Return a mask (N, 1, y, x): 1 where a picture of `isp=network` is valid, else 0. A pixel is
    valid if no sample less than one cell of the filter array away is clipped or broken.

    Parameters
    ----------
    patches : samples and truth.
    period : period of the filter array, pixels.
    """
    broken = 1 - patches.valid.amax(1, keepdim=True)
    return 1 - functional.max_pool2d(broken, 2 * period - 1, 1, period - 1)


@torch.no_grad()
def loss_on(network: PictureNetwork, pictures: HeldOut) -> float:
    """Return the mean loss in units of noise, over every second illuminance and patch.

    Parameters
    ----------
    network : network that is checked.
    pictures : held-out pictures.
    """
    losses = []
    for _, patches, xyz, _ in pictures.thinned().answers(network):
        whole = patches.valid.amax(1, keepdim=True)
        losses.append(float(noise_loss((xyz - patches.truth) * whole, patches)))
    return float(np.mean(losses))


@torch.no_grad()
def rows_of(network: PictureNetwork, pictures: HeldOut) -> list[dict[str, Any]]:
    """Return the results at each illuminance, one row each, as `Sums.row` returns them.

    Parameters
    ----------
    network : network that is checked.
    pictures : held-out pictures.
    """
    return [
        Sums.of(patches, xyz, variance, pictures.period).row(lux)
        for lux, patches, xyz, variance in pictures.answers(network)
    ]


@torch.no_grad()
def rows_of_new_sheets(
    network: PictureNetwork, sheets: Sheets, brightest_lux: float, device: str
) -> list[dict[str, Any]]:
    """Return the results at each illuminance, one row each, as `Sums.row` returns them. They are
    of sheets that neither stopped the training nor calibrated the variance.

    Parameters
    ----------
    network : network that is checked.
    sheets : sheets of the held-out pictures.
    brightest_lux : largest illuminance that the camera can measure, lux.
    device : device of PyTorch.
    """
    filters = _filters(sheets, device)
    rows = []
    for number, lux in enumerate(_measurable(brightest_lux)):
        # `held_out` uses the sheets with numbers 0 to len(LUX) - 1; these begin after them
        numbers = (number + len(LUX) * k for k in range(1, NEW_SHEETS + 1))
        parts = [
            Sums.of(patches, xyz, variance, filters[1])
            for k in numbers
            for _, patches, xyz, variance in HeldOut(
                (_level(sheets, lux, k, device),), *filters
            ).answers(network)
        ]
        rows.append(Sums(*(np.concatenate(values) for values in zip(*parts))).row(lux))
    return rows


class Sums(NamedTuple):
    """Sums over the pixels of each patch that count, (patch,) each. Pixels close to a clipped
    sample do not count (`measured`), because its electrons are not known.
    """

    true_y: np.ndarray  # electrons
    seen_y: np.ndarray  # electrons
    pixels: np.ndarray
    stated: np.ndarray  # stated variance over that of a sample
    squared: np.ndarray  # squared error over the variance of a sample

    @classmethod
    def of(cls, patches: Batch, xyz: torch.Tensor, variance: torch.Tensor, period: int) -> Sums:
        """Return the sums over the pixels of each patch.

        Parameters
        ----------
        patches : samples and truth.
        xyz, variance : answer of the network (N, 3, y, x), electrons and their square.
        period : period of the filter array, pixels.
        """
        of = measured(patches, period)
        stated, squared = normalised(patches, xyz, variance, of)
        values = (patches.truth[:, 1:2] * of, xyz[:, 1:2] * of, of, stated, squared)
        return cls(*(value.double().sum((1, 2, 3)).cpu().numpy() for value in values))

    def row(self, lux: float) -> dict[str, Any]:
        """Return lux, mean_e (mean Y, electrons), mean_error_percent (of the mean Y, as the ratio
        of the sums over all patches), half_width_percent (of the 95 % interval of this error over
        patches; one patch with a lamp may hold most of the light), error_in_noise (rms error of X,
        Y, Z over the standard deviation of a sample), stated_over_true (ratio of variances).

        Parameters
        ----------
        lux : mean illuminance of the patches.
        """
        true_y = self.true_y.sum()
        pixels = self.pixels.sum()
        return {
            "lux": lux,
            "mean_e": float(true_y / pixels),
            "mean_error_percent": float(100 * (self.seen_y.sum() / true_y - 1)),
            "half_width_percent": 100 * half_width_of_ratio(self.seen_y, self.true_y),
            "error_in_noise": float(np.sqrt(self.squared.sum() / (3 * pixels))),
            "stated_over_true": float(self.stated.sum() / self.squared.sum()),
        }


def half_width_of_ratio(seen: np.ndarray, true: np.ndarray) -> float:
    """Return the half width of the 95 % interval of sum(seen) / sum(true), from independent pairs
    (Cochran 1977, Sampling Techniques, eq. 6.9); nan for one pair.

    Parameters
    ----------
    seen, true : (pair,) sums of each patch.
    """
    count = len(true)
    if count < 2:
        return float("nan")
    rest = seen - seen.sum() / true.sum() * true
    error = np.sqrt(count / (count - 1) * np.sum(rest**2)) / true.sum()
    return float(student_t.ppf(0.975, count - 1) * error)


def normalised(
    patches: Batch, xyz: torch.Tensor, variance: torch.Tensor, of: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return stated variance and squared error (N, 3, y, x), both over the local variance of a
    sample, so that bright pixels do not dominate.

    Parameters
    ----------
    patches : samples and truth.
    xyz : (N, 3, y, x) picture of the network, electrons of the unit channel.
    variance : (N, 3, y, x) its stated variance, square of the same unit.
    of : (N, 1, y, x) 1 for pixels that count, else 0.
    """
    unit = sample_variance(patches.raw, patches.noise)
    return variance * of / unit, (xyz - patches.truth) ** 2 * of / unit


@torch.no_grad()
def calibrate(network: PictureNetwork, pictures: HeldOut) -> None:
    """Set the network's correction of its variance, as a function of the local level, from held-out
    patches.

    Parameters
    ----------
    network : network that is calibrated in place.
    pictures : held-out pictures.
    """
    levels = torch.cat(
        [
            torch.log(sample_variance(patches.raw, patches.noise)).flatten()
            for _, patches in pictures.levels
        ]
    )
    edges = np.quantile(levels.cpu().numpy(), np.linspace(0, 1, BINS + 1))
    places = (edges[:-1] + edges[1:]) / 2
    places = places + 1e-3 * np.arange(BINS)  # strictly rising, even if many pixels are equal
    network.calibration_levels = torch.tensor(places, dtype=torch.float32, device=levels.device)
    network.calibration_logs = torch.zeros_like(network.calibration_levels)
    for _ in range(ROUNDS):
        sums = np.zeros((2, BINS))
        for _, patches, xyz, variance in pictures.answers(network):
            level = torch.log(sample_variance(patches.raw, patches.noise))
            which = np.searchsorted(edges[1:-1], level.cpu().numpy().ravel())
            of = measured(patches, pictures.period)
            for k, values in enumerate(normalised(patches, xyz, variance, of)):
                weights = values.mean(1).double().cpu().numpy().ravel()
                sums[k] += np.bincount(which, weights, BINS)
        change = np.log(np.maximum(sums[1], 1e-12) / np.maximum(sums[0], 1e-12))
        network.calibration_logs += torch.tensor(change, dtype=torch.float32, device=levels.device)


def worst_ratio(rows: Sequence[dict[str, Any]]) -> float:
    """Return the ratio of stated to true variance that is farthest from 1."""
    return max((row["stated_over_true"] for row in rows), key=lambda v: abs(np.log(v)))
