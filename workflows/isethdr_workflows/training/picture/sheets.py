"""Sheets: many patches of noise-free pictures side by side, exposed in one shot of the camera.

Sheet k is always the same, so a training that continues after an interruption gets the same data as
without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .bank import crop
from .camera import Samples, TrainingCamera
from .settings import SHEET

LUX = (0.003, 100.0)  # range of the mean illuminance of the sensor plane
LEVELLED = 0.8  # a patch is divided by its own level to this power
DARKEST = 1e-3  # least level of a patch for this, lux; darker patches stay dark
UNEVEN = 0.7  # standard deviation of the logarithm of a patch's light within the sheet
EVEN_CELLS = 8  # side of a shot of an even grey, cells of the filter array
NOT_HOT = 0.95  # share of the samples in the dark that are not of hot pixels
MEASURED = 0.99  # least share of the pixels of an even grey that must not be saturated


class Source(NamedTuple):
    """Noise-free pictures of one kind."""

    name: str
    pictures: Sequence[np.ndarray]  # each (plane, y, x), XYZ last, mean illuminance 1 lux
    wavelength_nm: tuple[float, ...]
    share: float  # share of the sheets


class Patches(NamedTuple):
    """Patches of a sheet, (N, plane, y, x) float32."""

    raw: np.ndarray
    noise: np.ndarray
    valid: np.ndarray
    truth: np.ndarray


@dataclass(frozen=True, eq=False)
class Sheets:
    """The sheets of a training.

    Parameters
    ----------
    camera : camera that exposes the sheets.
    sources : sources of the pictures.
    patch_px : side of a patch, a multiple of the filter array's period.
    seed : seed of places, light and noise.
    lux : range of the mean illuminance of a sheet.
    """

    camera: TrainingCamera
    sources: tuple[Source, ...]
    patch_px: int
    seed: int
    lux: tuple[float, float] = LUX

    @property
    def patches(self) -> int:
        """The number of patches of a sheet."""
        return SHEET

    def sheet(self, number: int) -> Patches:
        """Return the patches of one sheet in random order."""
        rng = np.random.default_rng([self.seed, number])
        shares = np.array([source.share for source in self.sources])
        source = self.sources[int(rng.choice(len(shares), p=shares / shares.sum()))]
        lux = np.exp(rng.uniform(*np.log(self.lux)))
        side = self.patch_px
        planes = np.stack(
            [
                levelled(crop(source.pictures, side, rng)) * drawn_factor(rng)
                for _ in range(self.patches)
            ]
        )
        order = rng.permutation(self.patches)
        together = joined(planes * np.float32(lux))
        samples = self.camera.shot(together[:-3], source.wavelength_nm, int(rng.integers(2**31)))
        return patches_of(samples, together[-3:], side, order)


def levelled(planes: np.ndarray) -> np.ndarray:
    """Return a patch (plane, y, x) with a mean closer to 1 lux, in which lamps are clipped.
    Otherwise the dark parts of a road would always be dark compared with its lamps.
    """
    y = planes[-2]
    level = float(np.minimum(y, np.percentile(y, 95)).mean())
    return planes / np.float32(max(level, DARKEST) ** LEVELLED)


def drawn_factor(rng: np.random.Generator) -> np.float32:
    """Return a random ratio of the light of a patch to that of its sheet, with a mean of 1."""
    return np.float32(np.exp(rng.normal(-(UNEVEN**2) / 2, UNEVEN)))


def patches_of(samples: Samples, xyz_lux: np.ndarray, side: int, order: np.ndarray) -> Patches:
    """Return the patches of one shot, in a given order.

    Parameters
    ----------
    samples : captures of one shot.
    xyz_lux : (3, y, x) X, Y, Z on the sensor plane, lux.
    side : side of a patch, pixels.
    order : numbers of the patches, in the order of the result.
    """
    truth = (xyz_lux * samples.unit_e_per_lux).astype(np.float32)
    planes = (samples.raw, samples.noise, samples.valid, truth)
    return Patches(*(parted(values, side)[order] for values in planes))


def joined(patches: np.ndarray) -> np.ndarray:
    """Return square patches (N, plane, y, x) as one picture (plane, y, x). N is a square number."""
    count = round(len(patches) ** 0.5)
    rows = patches.reshape(count, count, *patches.shape[1:])
    planes = rows.transpose(2, 0, 3, 1, 4)
    return planes.reshape(patches.shape[1], count * patches.shape[2], -1)


def parted(picture: np.ndarray, side: int) -> np.ndarray:
    """Return a picture (plane, y, x) as square patches (N, plane, y, x).

    Parameters
    ----------
    picture : picture with rows and columns that are multiples of `side`.
    side : side of a patch, pixels.
    """
    planes, height, width = picture.shape
    tiles = picture.reshape(planes, height // side, side, width // side, side)
    return tiles.transpose(1, 3, 0, 2, 4).reshape(-1, planes, side, side)


def even_shot(camera: TrainingCamera, wavelength_nm: tuple[float, ...], lux: float) -> Samples:
    """Return the samples of one shot of an even grey.

    Parameters
    ----------
    camera : camera of the training.
    wavelength_nm : centres of the bands of the light, nm.
    lux : illuminance of the sensor plane.
    """
    weights = camera.plane_weights(wavelength_nm)
    grey = weights.sum(1) / weights[-2].sum()  # planes of an equal-energy light of 1 lux
    side = EVEN_CELLS * camera.period
    even = np.broadcast_to(grey[:-3, None, None], (len(grey) - 3, side, side))
    return camera.shot(even * lux, wavelength_nm, seed=0)


def dark_noise_e2(camera: TrainingCamera, wavelength_nm: tuple[float, ...]) -> np.ndarray:
    """Return the variance (plane,) of a sample besides shot noise in the darkest light of the
    training, electrons squared. Nearly all samples have at most this variance; the others are of
    hot pixels. Beyond the darkest light, scaled captures have some of their shot noise in it.

    Parameters
    ----------
    camera : camera of the training.
    wavelength_nm : centres of the bands of the light, nm.
    """
    noise = even_shot(camera, wavelength_nm, LUX[0]).noise.astype(float)
    return np.quantile(noise**2, NOT_HOT, axis=(1, 2))


def brightest_lux(camera: TrainingCamera, wavelength_nm: tuple[float, ...]) -> float:
    """Return the largest illuminance, at most 100 lux, at which the camera can measure an even
    grey. With a fixed exposure, brighter light saturates it.

    Parameters
    ----------
    camera : camera of the training.
    wavelength_nm : centres of the bands of the light, nm.
    """
    lux = LUX[1]
    while lux > LUX[0]:
        samples = even_shot(camera, wavelength_nm, lux)
        if samples.valid.max(0).mean() >= MEASURED:
            break
        lux /= 2
    return lux
