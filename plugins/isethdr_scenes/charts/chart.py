"""Fields that all charts share; their grid, illuminant and dataset."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.categories import CATEGORIES
from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed
from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, Cost
from isethdr_core.plugins.ranges import Wavelength, check_ranges
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.uncertainty.error_terms import Quantity

from ..limits import BandStep, Field, Luminance, Tiles
from .daylight import DAYLIGHT_K, daylight

if TYPE_CHECKING:
    import xarray as xr
    from colour import SpectralDistribution

# Number of steps of the midpoint rule in a band; the error is 2e-6 for tungsten light in bands of
# 10 nm
STEPS = 20


@dataclass(frozen=True)
class Chart:
    """Grid, wavelengths and illuminant of a chart; tiles are square."""

    THREAD_SAFE: ClassVar[bool] = True

    width: Tiles = 320  # tiles across
    height: Tiles = 180  # tiles down
    # full horizontal field angle; at most 150 with projection=tangent
    horizontal_field_deg: Field = 40.0
    luminance_cd_m2: Luminance = 100.0  # luminance of the brightest part, or of a perfect white
    first_nm: Wavelength = 400.0  # centre of the first band
    last_nm: Wavelength = 700.0  # centre of the last band
    step_nm: BandStep = 10.0  # width and spacing of the bands
    # spectrum of the light: daylight, tungsten or equal energy
    spectrum: Literal["D65", "A", "E"] = "D65"
    # projection of the grid of tiles; equidistant serves wide lenses
    projection: Literal["tangent", "equidistant"] = "tangent"

    # not a field of the component
    accuracy_knobs = (
        AccuracyKnob(
            "step_nm",
            (50.0, 30.0, 20.0, 10.0, 5.0),
            Quantity.ELECTRONS,
            Cost(1.0, 1.0),
            reference=2.0,
        ),
    )

    def __post_init__(self) -> None:
        check_ranges(self)
        widest = 150 if self.projection == "tangent" else 360
        if self.horizontal_field_deg > widest:
            raise ConfigError(
                f"horizontal_field_deg is {self.horizontal_field_deg:g}; "
                f"expected more than 0, at most {widest}"
                + "; type scene.projection=equidistant for more"
                * (widest == 150)
            )
        if self.first_nm > self.last_nm:
            raise ConfigError(
                f"wavelengths {self.first_nm:g} to {self.last_nm:g} nm are not a grid; expected "
                "first_nm <= last_nm; type scene.first_nm=400 scene.last_nm=700"
            )
        self.white()

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups. By default a chart is lit by the group `sky` alone."""
        return ("sky",)

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the chart."""
        return camera_field(self.horizontal_field_deg, self.width / self.height, self.projection)

    def tile_counts(self, margin: bool) -> tuple[int, int]:
        """Return (rows, columns) of tiles. A chart has no tiles beyond its field, so `margin` has
        no effect.
        """
        return self.height, self.width

    def bands_nm(self) -> np.ndarray:
        """Return the band centres, nm, from `first_nm` up to at most `last_nm`."""
        count = math.floor((self.last_nm - self.first_nm) / self.step_nm + 1e-9) + 1
        return self.first_nm + self.step_nm * np.arange(count)

    def white(self) -> np.ndarray:
        """Return the radiance (wavelength,), W m-2 sr-1 nm-1, of the illuminant at 1 cd/m2.

        Raises
        ------
        ConfigError : no band is visible, so no luminance can be reached.
        """
        bands = self.bands_nm()
        relative = band_means(illuminant(self.spectrum), bands)
        unit = float(luminance(relative, bands))
        if not unit > 0:
            raise ConfigError(
                f"bands {bands[0]:g}-{bands[-1]:g} nm hold no visible light, so no luminance; type"
                " scene.first_nm=400"
            )
        return np.asarray(relative / unit)

    def distance(self, angle_deg: float) -> float:
        """Return the distance of a field angle from the centre of the chart, in the projection's
        unit: the tangent of the angle, or the angle in radians.
        """
        angle = math.radians(angle_deg)
        return math.tan(angle) if self.projection == "tangent" else angle

    def tiles(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return x (width,), y (height,) tile centres and the pitch of a tile, in the projection's
        unit.
        """
        field = 2 * self.distance(self.horizontal_field_deg / 2)
        pitch = field / self.width
        return centres(self.width, field), centres(self.height, pitch * self.height), pitch

    def dataset(self, groups: dict, **labels: np.ndarray) -> xr.Dataset:
        """Return the chart's scene radiance Dataset from {group: (wavelength, y, x) radiance} and
        labels.
        """
        coarse, fine = (
            band_means(illuminant(self.spectrum), self.bands_nm(), steps)
            for steps in (STEPS, 8 * STEPS)
        )
        ledger.error(
            max(float(np.max(np.abs(coarse / fine - 1))), 2.0**-24),
            "relative",
            "measured",
            "spectrum of the light, averaged over each band, rounded to float32; tiles are covered"
            " exactly",
        )
        x, y, pitch = self.tiles()
        field = (pitch * self.width, pitch * self.height)
        ds = scene_radiance(
            np.stack(
                [
                    np.broadcast_to(cube, (len(self.bands_nm()), self.height, self.width))
                    for cube in groups.values()
                ]
            ),
            groups,
            self.bands_nm(),
            x,
            y,
            field,
            self.projection,
            **labels,
        )
        ds.attrs.update(objects=[], lamps=[], pitch_x=pitch, pitch_y=pitch)
        return ds


def band_means(
    spectrum: Callable[..., Any], bands_nm: np.ndarray, steps: int = STEPS
) -> np.ndarray:
    """Return the means of `spectrum(wavelength_nm)` over bands, by the midpoint rule.

    The border between two bands lies half way between their middles.

    Parameters
    ----------
    spectrum : function of wavelengths (band, step) in nm.
    bands_nm : (band,) middles of the bands, nm, increasing.
    steps : points of the midpoint rule in a band.
    """
    inside = (np.arange(steps) + 0.5) / steps - 0.5
    return spectrum(bands_nm[:, None] + inside * band_widths_nm(bands_nm)[:, None]).mean(1)


def table(distribution: SpectralDistribution) -> Callable[..., Any]:
    """Return a function of the wavelength in nm from a colour-science distribution.

    It is linear between the table's wavelengths, and constant beyond its ends.
    """
    return lambda nm: np.interp(nm, distribution.wavelengths, distribution.values)


def chart_object(
    instance: int, name: str, left: float, top: float, width: float, height: float
) -> dict:
    """Return a row of the objects table for a part of a chart.

    Parameters
    ----------
    instance : number of the part, from 1.
    name : name of the part.
    left, top : first column and row of its box, in tiles; fractions are allowed.
    width, height : size of its box, in tiles.
    """
    return {
        "instance": instance,
        "category": "chart",
        "name": name,
        "box": [left, top, width, height],
        "visible_fraction": 1.0,
        "distance_m": math.inf,
        "position_m": None,
    }


def category_of(instance: np.ndarray) -> np.ndarray:
    """Return the category label (y, x) of an instance label: `chart` for every instance, else 0."""
    return np.where(instance > 0, CATEGORIES["chart"], 0).astype(np.uint16)


def illuminant(name: str) -> Callable[..., Any]:
    """Return a function of the wavelength in nm: the relative spectrum of D65, A or E."""
    if name == "E":
        return lambda nm: np.ones_like(nm)
    if name == "A":  # CIE 15:2018, eq. 4.1 (relative; 1 at 560 nm)
        return lambda nm: (
            (560 / nm) ** 5 * np.expm1(1.435e7 / (2848 * 560)) / np.expm1(1.435e7 / (2848 * nm))
        )
    if name in DAYLIGHT_K:
        return daylight(DAYLIGHT_K[name])
    with needed(f"the illuminant {name}", extra="colour"):
        import colour  # more than a second

    return table(colour.SDS_ILLUMINANTS[name])
