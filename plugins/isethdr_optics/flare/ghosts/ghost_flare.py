"""The flare `ghosts`: light reflected twice between surfaces of a lens prescription, on the sensor
plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from cachetools import LRUCache

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, Cost
from isethdr_core.plugins.ranges import Percent, Share, check_ranges
from isethdr_core.uncertainty.error_terms import Quantity

from ...lenses.limits import Blades, Direction
from ...prescription.coatings import Powers
from ...prescription.prescription import check_coating, load, own_files
from ..added_light import added_light
from .draw import Canvas, Iris, points, sources
from .trace import acceptance, beams, boxes, rank, split

if TYPE_CHECKING:
    import xarray as xr

    from ...abilities import FieldAngles, LensOptics, PupilOptics
    from ...prescription.prescription import Prescription
    from .draw import Source
    from .trace import Pair

PART = "light of ghosts"  # part of the light on which the errors of ghosts act


@dataclass(frozen=True)
class GhostFlare:
    """Ghosts: reflections between pairs of surfaces of a lens prescription, traced with real rays
    and coatings.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # name of a lens prescription, or path of a .yaml file; it is scaled to the focal length and
    # stopped to the f-number of the lens
    prescription: str = "double_gauss_camera"
    # coating of all glass surfaces: none, mgf2, multilayer, broadband; empty takes the coatings of
    # the prescription
    coating: str = ""
    # share of the scene's light that all neglected ghosts may carry together: half of it for
    # neglected pairs of surfaces, half for weak ghosts of weak lamps
    error_allowed: Share = 1e-5
    sensor_reflectance_percent: Percent = 2.0  # specular reflectance of the sensor
    blades: Blades = 0  # number of blades of the iris; below 3 the iris is round
    rotation_deg: Direction = 17.0  # rotation of the iris about the optical axis

    # not a field; each factor of the error adds about the same number of pairs
    accuracy_knobs = (
        AccuracyKnob(
            "error_allowed",
            (1e-3, 1e-4, 1e-5, 1e-6),
            Quantity.IRRADIANCE,
            Cost(1.0),
            part=PART,
            reference=1e-8,
        ),
    )

    def __post_init__(self) -> None:
        check_ranges(self)
        load(self.prescription)
        if self.coating:
            check_coating(self.coating)

    def input_files(self) -> tuple[Any, ...]:
        """Return the user's own prescription file, if any. Its content is part of a run's name."""
        return own_files(self.prescription)

    def irradiance(self, lens: LensOptics, mixed: xr.DataArray) -> xr.DataArray:
        """Return the irradiance of the ghosts, W m-2 nm-1, on the tiles of `mixed`."""
        return _irradiance(self, lens, mixed)

    def of_lens(self, lens: LensOptics) -> Prescription:
        """Return the prescription with this flare's coating, and with the focal length and f-number
        of `lens`.
        """
        real = load(self.prescription).scaled(lens.focal_length_mm).stopped(lens.f_number)
        return real.with_coating(self.coating) if self.coating else real

    def iris(self, lens: LensOptics) -> Iris | None:
        """Return the `draw.Iris` of this flare in `lens`; None if it is round."""
        if self.blades < 3:
            return None
        real = self.of_lens(lens)
        return Iris(self.blades, self.rotation_deg, real.surfaces[real.stop].semi_diameter_mm)

    def check_lens(self, lens: LensOptics, field: FieldAngles) -> None:
        """Raise ConfigError unless the field is in tangents."""
        _check_projection(field.projection)

    def pairs(
        self, lens: LensOptics, wavelength_nm: np.ndarray, largest_tangent: float
    ) -> tuple[list[Any], ...]:
        """Return two lists of `trace.Pair`: the pairs to trace, the strongest first, and the other
        pairs, the weakest first.

        Parameters
        ----------
        lens : a lens of this package.
        wavelength_nm : (band,) centres of the bands, nm.
        largest_tangent : largest tangent of the field angle.
        """
        wave = tuple(map(float, wavelength_nm))
        ranked = _ranked(
            self.of_lens(lens), wave, float(largest_tangent), self.sensor_reflectance_percent / 100
        )
        # the other half of the allowed error is for weak ghosts of weak lamps
        return split(ranked, self.error_allowed / 2)


def ghost_seconds(
    flare: GhostFlare,
    lens: PupilOptics,
    wavelength_nm: np.ndarray,
    largest_tangent: float,
) -> float:
    """Return the CPU seconds of the ghosts of a typical night scene, with `TYPICAL_SOURCES`
    sources.

    Parameters
    ----------
    flare : the ghosts.
    lens : a lens of this package.
    wavelength_nm : (band,) centres of the bands, nm.
    largest_tangent : largest tangent of the field angle.
    """
    traced, _ = flare.pairs(lens, wavelength_nm, largest_tangent)
    return len(traced) * (TRACED_S + SOURCE_S * TYPICAL_SOURCES * len(wavelength_nm))


TYPICAL_SOURCES = 40  # number of lamps and blocks of directions in a typical night scene
# CPU seconds, measured on a busy machine: per source, pair and band; and per pair for its rays, in
# 31 bands
SOURCE_S = 1.7e-4
TRACED_S = 0.1
# number of radial bins of the field; rays of lamps are traced once per bin and cached
RADIAL_BINS = 24  # least number; there are more for narrow ghosts of slow stops
# largest movement of a beam at the front from one border of a bin to the other, in half widths of
# the beam: interpolation between the borders then loses 6 % of the beam in the middle
MOVED = 0.5
# largest relative error of a tile's ghosts in 99 % of the tiles, measured on three prescriptions
# against 4 times the rays and points
DRAWING = 0.1
MOST_BEAMS = 2000  # largest number of cached beams; 0.3 MB each with 31 bands
_beams: LRUCache[tuple, tuple | None] = LRUCache(maxsize=MOST_BEAMS)
_lock = Lock()  # reading an entry changes the order of the cache


@lru_cache(maxsize=8)
def _powers(
    real: Prescription, wavelength_nm: Sequence[float], sensor_reflectance: float
) -> Powers:
    return Powers(real, wavelength_nm, sensor_reflectance)


@lru_cache(maxsize=32)
def _ranked(
    real: Prescription,
    wavelength_nm: Sequence[float],
    largest_tangent: float,
    sensor_reflectance: float,
) -> list[Pair]:
    return rank(_powers(real, wavelength_nm, sensor_reflectance), largest_tangent)


def _check_projection(projection: str) -> None:
    if projection != "tangent":
        raise ConfigError(
            f"ghosts of a field in {projection!r} projection; expected tangents, which end at 75"
            " degrees; remove this flare"
        )


def _irradiance(flare: GhostFlare, lens: LensOptics, mixed: xr.DataArray) -> xr.DataArray:
    from isethdr_core.cli.progress import track

    quantities.check_mixed(mixed)
    _check_projection(mixed.attrs.get("projection", "tangent"))
    wave = mixed.wavelength.values.astype(float)
    x, y = (mixed[d].values.astype(float) for d in ("x", "y"))
    pitch = [quantities.tile_pitch(mixed, d) for d in ("y", "x")]
    largest = float(np.hypot(np.abs(x).max() + pitch[1] / 2, np.abs(y).max() + pitch[0] / 2))
    real = flare.of_lens(lens)
    traced, weak_pairs = flare.pairs(lens, wave, largest)
    powers = _powers(real, tuple(wave), flare.sensor_reflectance_percent / 100)
    # power through a plane perpendicular to the axis: radiance x solid angle (cos^3 for a tile in
    # tangents) x cosine
    power_per_radiance = (
        (1 + x[None, :] ** 2 + y[:, None] ** 2) ** -2 * pitch[0] * pitch[1] * lens.transmittance
    )
    light_sources, in_blocks = sources(mixed.values * power_per_radiance, x, y, pitch)
    f = lens.focal_length_mm
    canvas = Canvas(len(wave), x * f, y * f, [p * f for p in pitch])
    iris = flare.iris(lens)
    drawn, dim = _worth_drawing(light_sources, traced, flare.error_allowed / 2)
    for pair in track(traced, "ghosts of pairs of surfaces", len(traced)):
        lit = [s for s, p in drawn if p is pair]
        bins = _radial_bins(real, pair, float(np.median(wave)), largest)
        intervals = [_tangents(s, largest, bins) for s in lit]
        beams_of_pair = _beams_of(real, powers, pair, intervals, iris is not None)
        for source, tangents in zip(lit, intervals):
            if beams_of_pair[tangents] is not None:
                limits, low, high = beams_of_pair[tangents]
                canvas.draw(*points(source, low, high, tangents, limits, iris))
    added = added_light(lens, mixed, canvas.irradiance() * 1e6)
    _record_errors(ledger, traced, weak_pairs, dim, in_blocks, added)
    return added


def _worth_drawing(
    light_sources: Sequence[Any], traced: Sequence[Any], error_allowed: float
) -> tuple[list[Any], float]:
    """Return [(source, pair), ...] without the weakest, and the light of the weakest as a share of
    the scene's light. The share is at most `error_allowed`.
    """
    if not light_sources or not traced:
        return [], 0.0
    light = np.array([s.power.sum() for s in light_sources])
    share = np.outer(light / light.sum(), [p.share for p in traced]).ravel()
    order = np.argsort(share, kind="stable")
    few = int(np.searchsorted(np.cumsum(share[order]), error_allowed, side="right"))
    return [
        (light_sources[k // len(traced)], traced[k % len(traced)]) for k in sorted(order[few:])
    ], float(share[order[:few]].sum())


def _radial_bins(real: Prescription, pair: Pair, wavelength_nm: float, largest: float) -> int:
    """Return the number of radial bins for one ghost of a field that extends to the tangent
    `largest`.
    """
    half_mm, moved_mm = acceptance(real, pair, wavelength_nm)
    return max(RADIAL_BINS, int(np.ceil(moved_mm * largest / (MOVED * half_mm))))


def _tangents(source: Source, largest: float, bins: int) -> tuple[float, float]:
    """Return two field tangents around a source: the ends of its radial bin, or of its extent if
    that is wider.
    """
    reach = np.hypot(source.half_x, source.half_y)
    middle = np.hypot(source.x, source.y)
    step = largest / bins
    if reach < step:
        first = np.floor(middle / step)
        return float(first * step), float((first + 1) * step)
    return float(max(middle - reach, 0.0)), float(middle + reach)


def _beams_of(
    real: Prescription,
    powers: Powers,
    pair: Pair,
    intervals: Sequence[tuple[float, float]],
    iris: bool,
) -> dict:
    """Return {(low, high) tangents: (box, beam at low, beam at high)}, cached in the process.

    The value of an interval is None if no light passes.
    """
    lens = (
        real,
        tuple(powers.wavelength_nm),
        powers.sensor_reflectance,
        pair.front,
        pair.back,
        iris,
    )
    with _lock:
        beams_of_intervals = {
            i: _beams[lens, i] for i in dict.fromkeys(intervals) if (lens, i) in _beams
        }
    new = [i for i in dict.fromkeys(intervals) if i not in beams_of_intervals]
    if new:
        limits = boxes(real, pair, new, float(np.median(powers.wavelength_nm)))
        beams_of_intervals |= dict.fromkeys(new)
        lit = [(i, b) for i, b in zip(new, limits) if b is not None]
        if lit:
            traced_beams = beams(
                real,
                powers,
                pair,
                [t for i, _ in lit for t in i],
                [b for _, b in lit for _ in range(2)],
                iris=iris,
            )
            beams_of_intervals |= {
                i: (b, *traced_beams[2 * n : 2 * n + 2]) for n, (i, b) in enumerate(lit)
            }
        with _lock:
            _beams.update({(lens, i): beams_of_intervals[i] for i in new})
    return beams_of_intervals


def _record_errors(
    ledger: ModuleType,
    traced: Sequence[Any],
    weak_pairs: Sequence[Any],
    weak_share: float,
    in_blocks: float,
    added: xr.DataArray,
) -> None:
    label = (
        "ghosts of lamps: limit for 99 % of the tiles; the mean error is 0.04 of a tile, 0.006 of"
        " the flux"
    )
    ledger.error(DRAWING, "relative", "measured", label, key="ghost drawing", part=PART)
    ledger.light_part(PART, added)
    ledger.error(
        in_blocks * sum(p.share for p in traced),
        "fraction of energy",
        "bound",
        "ghosts of light that is summed in blocks of directions",
        key="ghosts of blocks",
    )
    if weak_pairs:
        named = ", ".join(f"{p.front}-{p.back}" for p in weak_pairs[-6:][::-1]) + (
            " ..." if len(weak_pairs) > 6 else ""
        )
        count = len(weak_pairs) + len(traced)
        ledger.left_out(
            f"ghosts of {len(weak_pairs)} of {count} pairs of surfaces ({named})",
            "less light than the error allowed",
            sum(p.share for p in weak_pairs),
            "share of the scene's light",
        )
    if weak_share:
        ledger.left_out(
            "weak ghosts of weak lamps",
            "less light than the error allowed",
            weak_share,
            "share of the scene's light",
        )
