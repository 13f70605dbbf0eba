"""Tails: light that is spread so far, and so thin, that no sensor can tell; kernels then end where
it begins.

What falls beyond a kernel that ends at some reach is known without knowing where: its energy is 1
less the kernel's sum. In any tile it adds something between nothing and that energy times the
brightest tile's light. The middle of both is added to every tile, so half of it is the largest
error, in every band, exactly; the least noise of any tile is known from the light that stays in its
own tile. No scene with a lamp in it comes below its noise by this rule, and then nothing is left
out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from isethdr_core.demand import Response
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.convolution import Kernel, prepare
from isethdr_core.physics.convolution.spectral import matrix_product

from ..psf import kernel_spectra, kernels
from ..psf.error_parts import term
from ..pupil import sampled_pupil
from .photoelectron_map import electrons

SHARE = 0.5  # of the error allowed of light
WORTH = 0.5  # of the frame's reach: kernels of more take about as long as those of all of it
EDGES = (
    0.5 * 0.9 * 2 / np.pi**2
)  # beyond a square of half width r: a round stop loses twice this x wavelength x f-number / r
LOOKED_AT = (
    4096  # tiles, spread evenly, from which the least noise is guessed before all are looked at
)
UNIT = "standard deviations of the sensor's noise"


@dataclass(frozen=True, eq=False)
class NearKernels(kernels.Kernels):
    """Kernels that end before the frame does."""

    frame: tuple[int, int] = (1, 1)  # (y, x) tiles of the images
    added: np.ndarray | None = (
        None  # irradiance / gain, per band: the middle of what the tail can bring
    )
    noise_share: float = 0.0  # bound on what the tail can change

    @cached_property
    def spectra(self) -> kernel_spectra.Spectra | None:
        """The kernels with their transforms, for images of the frame; None where memory is too
        small.
        """
        first = self._ready(0)
        if 2 * len(self.bands) * first.spectrum.nbytes > kernels.SPECTRA_BYTES:
            return None
        made = [first, *(self._ready(b) for b in range(1, len(self.bands)))]
        blocks = np.stack([k.spectrum for k in made])
        profiles = [kernel_spectra.profile(b) for b in self.bands]
        return kernel_spectra.Spectra(
            [replace(k, spectrum=b) for k, b in zip(made, blocks)], profiles, blocks
        )

    @cached_property
    def divided(self) -> kernel_spectra.Divided | None:
        """The same as one part: all is near."""
        known = self.spectra
        if known is None:
            return None
        peaks, norms = (
            np.array([getattr(k, name) for k in known.kernels]) for name in ("peak", "norm")
        )
        return kernel_spectra.Divided(
            kernel_spectra.Part(known.blocks, peaks, norms, known.kernels[0].size),
            None,
            known.profiles,
        )

    def ready(self, band: int) -> Kernel:
        """Return one band's kernel with its transform, for images of the frame."""
        return self.spectra.kernels[band] if self.spectra else self._ready(band)

    def _ready(self, band: int) -> Kernel:
        return prepare(self.bands[band], self.frame)


def cut_noise_share(made: kernels.Kernels | None) -> float:
    """Return the share of the sensor's noise that the cut tail of kernels may take; 0 if uncut."""
    return made.noise_share if isinstance(made, NearKernels) else 0.0


def near_kernels(make, lens, flares, mixed, sensor, pitch_um, response) -> NearKernels | None:
    """Return kernels that end where a sensor no longer sees the difference; None where all of the
    frame is needed.

    Parameters
    ----------
    make : function((y, x) reach) -> `kernels.Kernels` of the bands of `mixed`. `lens` : without
        geometry.
    sensor : `sensor_plane.SensorPlane`. `pitch_um` : (y, x) of a tile.
    response : `isethdr_core.demand.Response` of the sensors; None where all light is asked for.
    """
    if response is None or not lens.blurs or sensor.areas is not None or sensor.scales is not None:
        return None
    wave, shape = mixed.wavelength.values.astype(float), mixed.shape[1:]
    first, full = _core(lens, wave, pitch_um, shape), [n - 1 for n in shape]
    if any(r >= WORTH * n for r, n in zip(first, full)):
        return None
    allowed = SHARE * response.noise_fraction_allowed
    light = Light(
        np.asarray(mixed.values),
        sensor.relative,
        lens.throughput_sr() * electrons(response, wave),
        response,
    )
    widest = min(WORTH * n * p for n, p in zip(full, pitch_um))
    edges = (
        EDGES * wave / wave[0] * sampled_pupil.blur_um(lens, wave[0]) / widest
    )  # no stop is without them
    if any(
        light.share(edges, most=most()) > allowed
        for most in (light.most_of_some, lambda: light.most)
    ):  # a bright scene shows at once
        return None
    probe = kernels.kernels(
        lens, flares, wave[-1:], pitch_um, first
    )  # of one band, to know how far all have to reach
    ratio = light.share(probe.outside * wave / wave[-1]) / allowed
    reach = [int(np.ceil(r * max(1.0, 1.1 * ratio))) for r in first]
    if any(r > WORTH * n for r, n in zip(reach, full)):
        return None
    made = make(tuple(reach))
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in made.bands], float)
    outside, loss = np.maximum(made.outside, 0.0), made.transmitted if lens.aperture_loss else 1.0
    share = light.share(outside * loss, centre * loss, everywhere=True)
    if share > allowed:
        return None
    return NearKernels(
        **{k: v for k, v in vars(made).items() if k in kernels.Kernels.__dataclass_fields__},
        frame=tuple(shape),
        added=outside * light.most / 2,
        noise_share=share,
    )


def notes(made: NearKernels) -> list[Note]:
    """Return what was left out, and its bound."""
    rows, columns = (n // 2 for n in made.bands[0].shape)
    spared = LeftOut(
        f"where light goes that is spread more than {columns} x {rows} tiles,"
        f" {made.outside.max():.2g} of it at most",
        "no tile is so bright that the sensor could tell",
        made.noise_share,
        UNIT,
        needless=True,
    )
    label = "far tail of the point spread, the same light added to every tile in its place"
    return [spared, term(made.noise_share, UNIT, "bound", label, key="far tail")]


@dataclass(frozen=True, eq=False)
class Light:
    """What decides: the brightest light per band, and the least noise of any tile."""

    cube: np.ndarray  # (band, y, x) radiance
    relative: np.ndarray | float  # factor of the tiles' light, (y, x) or 1
    weights: np.ndarray  # (channel, band) electrons per m2 and second
    response: Response

    @cached_property
    def _step(self) -> int:
        return max(1, int(np.sqrt(self.cube[0].size / LOOKED_AT)))

    @cached_property
    def some(self) -> np.ndarray:
        """The light of the tiles looked at."""
        return self.cube[:, self._step // 2 :: self._step, self._step // 2 :: self._step]

    @cached_property
    def factor(self) -> np.ndarray | float:
        """The factor of the tiles looked at."""
        if not np.ndim(self.relative):
            return self.relative
        return self.relative[self._step // 2 :: self._step, self._step // 2 :: self._step]

    @cached_property
    def most(self):
        """The brightest light, per band."""
        return self._most(self.cube)

    def most_of_some(self):
        """Return the brightest light of the tiles looked at, per band."""
        return self._most(self.some)

    def _most(self, cube):
        return cube.max(axis=(1, 2)).astype(float) * float(np.max(self.relative))

    def share(self, outside, centre=1.0, everywhere: bool = False, most=None) -> float:
        """Return the largest error / the least noise: bound where all tiles are looked at
        `everywhere`, else at best so much.

        Parameters
        ----------
        outside : per band, energy beyond the kernel. `centre` : per band, what of a tile's light
            stays there.
        most : the brightest light, per band; None: of all tiles.
        """
        error = self.weights @ (outside * (self.most if most is None else most)) / 2
        light = self._least(self.weights * centre, everywhere)
        e, scale = max(self.response.read_noise_e, 1.0), self.response.area_exposure_m2_s
        return float(np.max(scale * error / np.sqrt(e**2 + scale * light)))

    def _least(self, weights, everywhere):
        """Return the least light of any tile, per channel."""
        if not everywhere:
            return (np.tensordot(weights, self.some, 1) * self.factor).min(axis=(1, 2))
        planes = matrix_product(weights, self.cube.reshape(len(self.cube), -1)).reshape(
            -1, *self.cube.shape[1:]
        )
        return (planes * self.relative).min(axis=(1, 2))


def _core(lens, wavelength_nm, pitch_um, shape) -> tuple[int, int]:
    """Return the (y, x) tiles within which kernels are exact: nearer nothing is to be had by ending
    them.
    """
    blur = sampled_pupil.blur_um(lens, float(wavelength_nm.min()))
    return tuple(
        min(n - 1, max(3, int(kernels.CORE_SAMPLES / max(2.0, np.ceil(2 * p / blur)))))
        for n, p in zip(shape, pitch_um)
    )
