"""Sensor-limited ghosts: pairs of surfaces with ghosts that are too faint for a sensor are left
out.

A bound on the sum of their light is stated. A pair of surfaces images the field onto the sensor
with its own magnification. If every tile were as bright as the brightest tile, the ghost would be
as bright as the image of that tile, times the pair's share of the light, divided by the square of
the magnification. This holds for paraxial rays; with real rays the peak is up to `PEAK` times
brighter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.data.error_costs import STORE
from isethdr_core.ledger import LeftOut, Note

from ...imaging import wing_truncation
from ...imaging.accuracy_shares import FAINT_GHOSTS
from ...imaging.photoelectron_map import electrons
from ...psf.error_parts import term
from .ghost_flare import GhostFlare

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Response
    from isethdr_core.plugins.protocols import Flare

    from ...abilities import LensOptics
    from ...imaging.field_optics import FieldOptics

# share of the allowed error of the light, for the faint ghosts of all flares together
SHARE = FAINT_GHOSTS / (1 - STORE)
# bound on the peak of a ghost with real rays over that with paraxial rays; the largest measured is
# 6.8 (uniform light, four prescriptions at f/4 to f/8, coatings none, mgf2, multilayer)
PEAK = 10.0


@dataclass(frozen=True)
class BrightGhosts(GhostFlare):
    """The ghosts of a flare, except those of `faint` pairs of surfaces."""

    faint: tuple[tuple[int, int], ...] = ()  # (front, back) surfaces of the pairs

    def pairs(
        self, lens: LensOptics, wavelength_nm: np.ndarray, largest_tangent: float
    ) -> tuple[list[Any], ...]:
        """Return (traced, left out) pairs, as `GhostFlare.pairs`.

        Parameters
        ----------
        lens : a lens of this package.
        wavelength_nm : centres of the bands, nm.
        largest_tangent : largest tangent of the field angle.
        """
        traced, weak = super().pairs(lens, wavelength_nm, largest_tangent)
        faint = [p for p in traced if (p.front, p.back) in self.faint]
        return [p for p in traced if p not in faint], sorted(weak + faint, key=lambda p: p.share)


class LimitedFlares(NamedTuple):
    """Flares without the ghosts that are too faint for a sensor."""

    flares: tuple
    bound: float = 0.0  # bound on the omitted ghosts, standard deviations of the sensor's noise
    notes: tuple[Note, ...] = ()  # the omitted ghosts, and their error


def without_faint_ghosts(
    lens: LensOptics,
    mixed: xr.DataArray,
    flares: Sequence[Flare],
    optics: FieldOptics,
    response: Response,
) -> LimitedFlares:
    """Return the flares without the ghosts that are too faint for the sensor.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    flares : flare components of the lens.
    optics : `field_optics.FieldOptics` of the field.
    response : `isethdr_core.demand.Response` of the sensors.
    """
    count = sum(type(flare) is GhostFlare for flare in flares)
    if not count:
        return LimitedFlares(flares)
    allowed = SHARE * response.noise_fraction_allowed / count
    wave = optics.wavelength_nm
    total = 0.0
    out = []
    notes = []
    centre = (
        1.0
        if optics.kernels is None
        else np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in optics.kernels.bands], float)
    )
    light = wing_truncation.Light(
        np.asarray(mixed.values),
        1.0 if optics.relative is None else optics.relative,
        electrons(response, wave) * lens.gains_sr(wave),
        response,
    )
    # irises and dirt of other flares take light from the image, not from ghosts
    of_image = optics.gains / lens.gains_sr(wave)
    # a ghost as bright as the brightest tile, over the sensor's noise
    unit = 2 * light.share(np.ones(len(wave)), centre * of_image, everywhere=True)
    for flare in flares:
        if type(flare) is GhostFlare:
            faint, share, left_out = _faint(flare, lens, mixed, wave, PEAK * unit, allowed)
            total += share
            notes += left_out
            flare = (
                BrightGhosts(**{f.name: getattr(flare, f.name) for f in fields(flare)}, faint=faint)
                if faint
                else flare
            )
        out.append(flare)
    return LimitedFlares(tuple(out), total, tuple(notes))


def _faint(
    flare: GhostFlare,
    lens: LensOptics,
    mixed: xr.DataArray,
    wave: np.ndarray,
    unit: float,
    allowed: float,
) -> tuple[tuple[Any, ...], float, list[Any]]:
    """Return (pairs, bound, notes): the pairs (front, back) of which all ghosts together stay below
    `allowed`.

    Parameters
    ----------
    flare : the ghosts.
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    wave : centres of the bands, nm.
    unit : peak of the ghost of a pair with share and magnification 1, over the sensor's noise.
    allowed : allowed sum of the peaks, over the sensor's noise.
    """
    x, y = (np.abs(mixed[d].values).max() for d in ("x", "y"))
    traced, _ = flare.pairs(lens, wave, float(np.hypot(x, y)))
    ranked = sorted(
        (p.share / p.magnification**2 if p.magnification else np.inf, p.front, p.back)
        for p in traced
    )
    bounds = unit * np.cumsum([r[0] for r in ranked])
    count = int(np.searchsorted(bounds, allowed, side="right"))
    if not count:
        return (), 0.0, []
    bound = float(bounds[count - 1])
    left_out = LeftOut(
        f"ghosts of {count} of {len(ranked)} pairs of surfaces",
        "no tile is bright enough for the sensor to see them",
        bound,
        wing_truncation.UNIT,
        needless=True,
    )
    label = "ghosts of pairs of surfaces that were left out"
    error = term(bound, wing_truncation.UNIT, "bound", label)
    return tuple((front, back) for _, front, back in ranked[:count]), bound, [left_out, error]
