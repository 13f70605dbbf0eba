"""Wing truncation: kernels end where the light beyond is too faint for any sensor.

The energy beyond a truncated kernel is 1 minus the kernel's sum. The light that this energy brings
to any tile is at least 0, and at most its product with the light of the brightest tile. Half of
that product is added to every tile, so that the error of a band is at most the other half. The
least noise of any tile follows from the light that stays in its own tile. In a scene with a lamp
the error exceeds the noise, and kernels are not truncated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.demand import Response
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.convolution import Kernel, prepare
from isethdr_core.physics.convolution.spectral import matrix_product

from ..psf import kernel_spectra, kernels
from ..psf.error_parts import term
from ..psf.kernels import core_size
from ..psf.kernels.kernel_set import SPECTRA_BYTES
from ..pupil import pupil_size
from .photoelectron_map import electrons

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics
    from .sensor_plane import SensorPlane

SHARE = 0.5  # share of the light's allowed error that truncation may use
# largest reach of truncated kernels over that of the frame: larger kernels take about as long as
# those of the whole frame
WORTH = 0.5
# The energy of a round stop beyond a square of half width r is 2 EDGES x wavelength x f-number / r.
EDGES = 0.5 * 0.9 * 2 / np.pi**2
# number of tiles, on a regular grid, for a first estimate of the least noise
SAMPLED_TILES = 4096
UNIT = "standard deviations of the sensor's noise"


@dataclass(frozen=True, eq=False)
class TruncatedKernels(kernels.Kernels):
    """Kernels that end before the frame does."""

    frame: tuple[int, int] = (1, 1)  # (y, x) tiles of the images
    # (band,) irradiance / gain that is added in place of the wings
    added: np.ndarray | None = None
    noise_share: float = 0.0  # bound on the error of leaving out the wings, over the noise

    @cached_property
    def spectra(self) -> kernel_spectra.Spectra | None:
        """The kernels with their transforms for images of the frame; None if memory is short."""
        first = self._ready(0)
        if 2 * len(self.bands) * first.spectrum.nbytes > SPECTRA_BYTES:
            return None
        prepared = [first, *(self._ready(b) for b in range(1, len(self.bands)))]
        blocks = np.stack([k.spectrum for k in prepared])
        profiles = [kernel_spectra.profile(b) for b in self.bands]
        return kernel_spectra.Spectra(
            [replace(k, spectrum=b) for k, b in zip(prepared, blocks)], profiles, blocks
        )

    @cached_property
    def divided(self) -> kernel_spectra.Divided | None:
        """The kernels as a near part only: truncated kernels have no far part."""
        spectra = self.spectra
        if spectra is None:
            return None
        peaks, norms = (
            np.array([getattr(k, name) for k in spectra.kernels]) for name in ("peak", "norm")
        )
        return kernel_spectra.Divided(
            kernel_spectra.Part(spectra.blocks, peaks, norms, spectra.kernels[0].size),
            None,
            spectra.profiles,
        )

    def ready(self, band: int) -> Kernel:
        """Return one band's kernel with its transform, for images of the frame."""
        return self.spectra.kernels[band] if self.spectra else self._ready(band)

    def _ready(self, band: int) -> Kernel:
        return prepare(self.bands[band], self.frame)


def truncation_noise_share(kernels_of_field: kernels.Kernels | None) -> float:
    """Return the error of truncation over the sensor's noise; 0 for kernels of the whole frame."""
    return kernels_of_field.noise_share if isinstance(kernels_of_field, TruncatedKernels) else 0.0


@dataclass(frozen=True)
class FieldOnSensor:
    """The light of a field, and its sensor plane."""

    mixed: xr.DataArray  # mixed radiance (wavelength, y, x)
    sensor: SensorPlane
    pitch_um: tuple[float, float]  # (y, x) pitch of the tiles


def truncated_kernels(
    make_kernels: Callable[..., Any],
    lens: LensOptics,
    flares: Sequence[Flare],
    field: FieldOnSensor,
    response: Response | None,
) -> TruncatedKernels | None:
    """Return kernels that end where a sensor sees no difference; None if they cannot be truncated.

    Parameters
    ----------
    make_kernels : function((y, x) reach in tiles) -> `kernels.Kernels` of the bands of the field.
    lens : lens without distortion and falloff (`sensor_plane.without_geometry`).
    flares : its flare components.
    field : light of the field, and its sensor plane.
    response : `isethdr_core.demand.Response` of the sensors; None: kernels are not truncated.
    """
    mixed = field.mixed
    sensor = field.sensor
    pitch_um = field.pitch_um
    if response is None or not lens.blurs or sensor.areas is not None or sensor.scales is not None:
        return None
    wave = mixed.wavelength.values.astype(float)
    shape = mixed.shape[1:]
    first = _core(lens, wave, pitch_um, shape)
    full = [n - 1 for n in shape]
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
    edges = EDGES * wave / wave[0] * pupil_size.blur_um(lens, wave[0]) / widest  # of every stop
    # a bright scene is rejected here, before any kernel is computed
    if any(
        light.share(edges, most=most()) > allowed
        for most in (light.brightest_sampled, lambda: light.brightest)
    ):
        return None
    # the kernel of one band gives the reach for all bands
    request = kernels.KernelRequest(lens, flares, wave[-1:], pitch_um, first)
    probe = kernels.kernels(request)
    ratio = light.share(probe.outside * wave / wave[-1]) / allowed
    reach = [int(np.ceil(r * max(1.0, 1.1 * ratio))) for r in first]
    if any(r > WORTH * n for r, n in zip(reach, full)):
        return None
    truncated = make_kernels(tuple(reach))
    centre = np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in truncated.bands], float)
    outside = np.maximum(truncated.outside, 0.0)
    loss = truncated.transmitted if lens.aperture_loss else 1.0
    share = light.share(outside * loss, centre * loss, everywhere=True)
    if share > allowed:
        return None
    return TruncatedKernels(
        **{k: v for k, v in vars(truncated).items() if k in kernels.Kernels.__dataclass_fields__},
        frame=tuple(shape),
        added=outside * light.brightest / 2,
        noise_share=share,
    )


def notes(truncated: TruncatedKernels) -> list[Note]:
    """Return the wings that were left out, and the bound on their effect."""
    rows, columns = (n // 2 for n in truncated.bands[0].shape)
    spared = LeftOut(
        f"distribution of the light in the PSF wings beyond {columns} x {rows} tiles, at most"
        f" {truncated.outside.max():.2g} of the light",
        "no tile is bright enough for the sensor to see a difference",
        truncated.noise_share,
        UNIT,
        needless=True,
    )
    label = "far wings of the point spread, replaced by uniform light"
    return [spared, term(truncated.noise_share, UNIT, "bound", label, key="far tail")]


@dataclass(frozen=True, eq=False)
class Light:
    """The light of a scene: its brightest tile per band, and the least noise of any tile."""

    cube: np.ndarray  # (band, y, x) radiance
    relative: np.ndarray | float  # factor of the tiles' light, (y, x) or 1
    weights: np.ndarray  # (channel, band) electrons per m2 and second, per radiance
    response: Response

    @cached_property
    def _step(self) -> int:
        return max(1, int(np.sqrt(self.cube[0].size / SAMPLED_TILES)))

    @cached_property
    def sampled(self) -> np.ndarray:
        """The light of the sampled tiles."""
        return self.cube[:, self._step // 2 :: self._step, self._step // 2 :: self._step]

    @cached_property
    def factor(self) -> np.ndarray | float:
        """The relative illumination of the sampled tiles."""
        if not np.ndim(self.relative):
            return self.relative
        return self.relative[self._step // 2 :: self._step, self._step // 2 :: self._step]

    @cached_property
    def brightest(self) -> np.ndarray:
        """The light of the brightest tile, (band,)."""
        return self._most(self.cube)

    def brightest_sampled(self) -> np.ndarray:
        """Return the light of the brightest sampled tile, (band,)."""
        return self._most(self.sampled)

    def _most(self, cube: np.ndarray) -> np.ndarray:
        return cube.max(axis=(1, 2)).astype(float) * float(np.max(self.relative))

    def share(
        self,
        outside: np.ndarray,
        centre: float | np.ndarray = 1.0,
        everywhere: bool = False,
        most: np.ndarray | None = None,
    ) -> float:
        """Return the largest error over the least noise.

        Parameters
        ----------
        outside : (band,) energy beyond the kernel.
        centre : (band,) share of a tile's light that stays in the tile.
        everywhere : whether the least noise is that of all tiles; the result is then an upper
            bound. False: that of the sampled tiles only; the true value may be larger.
        most : (band,) light of the brightest tile; None: the brightest of all tiles.
        """
        error = self.weights @ (outside * (self.brightest if most is None else most)) / 2
        light = self._least(self.weights * centre, everywhere)
        read_noise_e = max(self.response.read_noise_e, 1.0)
        scale = self.response.area_exposure_m2_s
        return float(np.max(scale * error / np.sqrt(read_noise_e**2 + scale * light)))

    def _least(self, weights: np.ndarray, everywhere: bool) -> np.ndarray:
        """Return the light of the darkest tile, (channel,)."""
        if not everywhere:
            return (np.tensordot(weights, self.sampled, 1) * self.factor).min(axis=(1, 2))
        planes = matrix_product(weights, self.cube.reshape(len(self.cube), -1)).reshape(
            -1, *self.cube.shape[1:]
        )
        return (planes * self.relative).min(axis=(1, 2))


def _core(
    lens: PupilOptics,
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> tuple[int, int]:
    """Return the tiles (y, x) from the axis within which kernels are exact. Shorter kernels would
    save no time.
    """
    blur = pupil_size.blur_um(lens, float(wavelength_nm.min()))
    return tuple(
        min(n - 1, max(3, int(core_size.CORE_SAMPLES / max(2.0, np.ceil(2 * p / blur)))))
        for n, p in zip(shape, pitch_um)
    )
