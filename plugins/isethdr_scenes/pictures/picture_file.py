"""The scene `file`: a picture or a spectral cube of the user."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.photometry import luminance
from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, Cost
from isethdr_core.plugins.ranges import Range, Wavelength, check_ranges
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.uncertainty.error_terms import Quantity

from ..charts.chart import band_means, illuminant
from ..limits import BandStep, Luminance
from . import units
from .content import LUMINANCE_CHANNELS, XYZ_CHANNELS, Content, Wanted
from .formats import Coding, checked_content, needs_path
from .primaries import CHROMATICITIES, Primaries, linear_srgb, luminance_of, named
from .rgb_to_spectra import primary_reflectances, spectra
from .units import Unit

if TYPE_CHECKING:
    import xarray as xr

# Rms difference between the electrons of true spectra and those of spectra made from RGB, relative
# to the electrons of the channel. Measured for 24 patches of a colour checker in D65 and the
# channels of the sensor `bayer` (tests/scenes/test_picture_file.py).
LIFT_ERROR = 0.063
VISIBLE_NM = np.arange(380.0, 781.0)  # grid for the luminance of an illuminant, nm
# Smallest share of the luminance of white that the bands of colours hold. The bands get all of the
# luminance, so a smaller share would give far too much radiance. One nm at 550 nm holds 0.01.
LEAST_SHARE = 0.005
PixelAngle = Annotated[float, Range(1e-6, 1000)]  # milliradians: a telescope's to a few pixels
FieldAngle = Annotated[float, Range(0.01, 360)]  # degrees


@dataclass(frozen=True)
class PictureFile:
    """Picture, photo or spectral cube of your own: EXR, HDR, TIFF, NumPy, zarr, NetCDF, PNG, JPEG.

    RGB is converted to the smoothest spectra of its colours (Mallett, Yuksel 2019).
    """

    THREAD_SAFE: ClassVar[bool] = True

    # the file: .exr, .hdr, .pic, .tif, .tiff, .npy, .npz, .nc, .nc4, .zarr, .png, .jpg, .jpeg, .bmp
    # or .webp
    path: str = ""
    # unit of the values: of spectral radiance for cubes, cd/m2 for luminance and for RGB whose
    # (1, 1, 1) has 1 cd/m2, or reflectance; not needed where the file states it
    unit: Unit = "not_stated"
    # luminance of (1, 1, 1), of luminance 1 or of reflectance 1, for values without a unit; null:
    # as the file states it
    white_cd_m2: Luminance | None = None
    # full horizontal field angle; this or pixel_mrad must be set
    horizontal_field_deg: FieldAngle | None = None
    # angle that one pixel spans on the axis, in milliradians; in place of horizontal_field_deg
    pixel_mrad: PixelAngle | None = None
    # projection of the pixels; equidistant serves fields wider than 150 degrees
    projection: Literal["tangent", "equidistant"] = "tangent"
    # names of one luminance channel or of red, green, blue, for an EXR with other names
    channels: tuple[str, ...] = ()
    # centres of the bands of a cube whose file does not state them
    wavelength_nm: tuple[Wavelength, ...] = ()
    variable: str = ""  # name of the array, in a file with several
    # primaries of RGB, with a D65 white; a file with channels X, Y, Z needs xyz
    primaries: Primaries = "srgb"
    # how colours are coded; integers must state it, other values are linear by default
    encoding: Coding = "not_stated"
    # spectrum of white, for RGB, luminance and reflectance
    spectrum: Literal["D65", "A", "E"] = "D65"
    first_nm: Wavelength = 400.0  # centre of the first band, for RGB and luminance
    last_nm: Wavelength = 700.0  # centre of the last band, for RGB and luminance
    step_nm: BandStep = 10.0  # width and spacing of the bands, for RGB and luminance
    # true sets negative values to 0 and states how many; false refuses them
    negative_to_zero: bool = False

    # not a field. The bands are those of spectra made from colours; wider bands cannot hold RGB.
    accuracy_knobs = (
        AccuracyKnob(
            "step_nm",
            (20.0, 10.0, 5.0),
            Quantity.ELECTRONS,
            Cost(1.0, 1.0),
            reference=2.0,
            matters=lambda scene: scene._content().wavelength_nm is None,
        ),
    )

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.first_nm > self.last_nm:
            raise ConfigError(
                f"wavelengths {self.first_nm:g} to {self.last_nm:g} nm are not a grid; expected"
                " first_nm <= last_nm; type scene.first_nm=400 scene.last_nm=700"
            )
        if self.horizontal_field_deg is not None and self.pixel_mrad is not None:
            raise ConfigError(
                "horizontal_field_deg and pixel_mrad are both set; expected one of them; type"
                " scene.pixel_mrad=null"
            )

    def input_files(self) -> Iterable[Path]:
        """Return the file that is read, or the folder of a zarr store.

        Its content is part of the name of a run.
        """
        return (needs_path(self.path),)

    def check_files(self) -> None:
        """Read the file, and check its values and their unit.

        Raises
        ------
        ConfigError : the unit, the field angle or the coding is not stated, or does not fit.
        CatalogError : the file does not exist or cannot be read.
        UnitError : its values are not light, or its channels or unit are unknown.
        """
        self.camera_field()
        if len(self._content().channels) == 3:
            self._reflectances()
        elif self._content().wavelength_nm is None:
            self._white(self.bands_nm())

    def light_groups(self) -> tuple[str, ...]:
        """Return the light groups: `picture` alone, unless a cube names others."""
        return self._content().groups

    def bands_nm(self) -> np.ndarray:
        """Return the band centres, nm: those of a cube, or `first_nm` to `last_nm`."""
        stated = self._content().wavelength_nm
        if stated is not None:
            return np.asarray(stated, float)
        count = math.floor((self.last_nm - self.first_nm) / self.step_nm + 1e-9) + 1
        return self.first_nm + self.step_nm * np.arange(count)

    def tile_counts(self, margin: bool) -> tuple[int, int]:
        """Return (rows, columns) of pixels. A file has no pixels beyond its field, so `margin` has
        no effect.
        """
        rows, columns = self._content().values.shape[2:]
        return rows, columns

    def camera_field(self) -> tuple[float, float, str]:
        """Return (width, height, projection) of the picture.

        Raises
        ------
        ConfigError : no field angle is stated, or it is too wide for the projection.
        """
        # if both the unit and the field angle are missing, the error names the unit
        self._per_value(self._content())
        rows, columns = self.tile_counts(False)
        field_deg = self.horizontal_field_deg
        if self.pixel_mrad is not None:
            half = 5e-4 * self.pixel_mrad * columns
            half = math.atan(half) if self.projection == "tangent" else half
            field_deg = 2 * math.degrees(half)
        if field_deg is None:
            raise ConfigError(
                f"the field angle of {self.path} is not stated; expected the full horizontal angle,"
                " or the angle of a pixel; type for example scene.horizontal_field_deg=40"
                " or scene.pixel_mrad=0.35"
            )
        widest = 150 if self.projection == "tangent" else 360
        if field_deg > widest:
            raise ConfigError(
                f"the horizontal field is {field_deg:g} degrees; expected at most {widest}"
                + "; type scene.projection=equidistant for more" * (widest == 150)
            )
        return camera_field(field_deg, columns / rows, self.projection)

    def __call__(self) -> xr.Dataset:
        """Return scene radiance, W m-2 sr-1 nm-1.

        Raises
        ------
        ConfigError, CatalogError, UnitError : as `check_files`.
        """
        content = self._content()
        scale = self._per_value(content)
        bands = self.bands_nm()
        if content.zeroed:
            ledger.left_out(
                f"{content.zeroed} negative values of the file",
                "scene.negative_to_zero",
                content.most_negative,
                "the file's unit",
            )
        if content.wavelength_nm is None:
            cube = self._lifted(scale * content.values[0].astype(float), content, bands)[None]
        else:
            cube = self._cube(content, scale, bands)
        return self._dataset(cube, content, bands)

    def _content(self) -> Content:
        selection = Wanted(self.channels, self.wavelength_nm, self.variable)
        return checked_content(self.path, selection, self.encoding, self.negative_to_zero)

    def _per_value(self, content: Content) -> float:
        """Return the factor that converts values of the file to cd/m2 or W m-2 sr-1 nm-1.

        The former is the unit of colours, the latter that of cubes. For reflectances the factor is
        the luminance of a reflectance of 1.

        Raises
        ------
        ConfigError : the unit is not stated, stated twice, or not one for these values.
        UnitError : the file states another unit than the scene.
        """
        self._check_colours(content)
        stated = self._stated_unit(content)
        unit = stated if self.unit == units.NOT_STATED else self.unit
        if stated is not None and unit != stated:
            raise UnitError(
                f"{self.path} states the unit {content.unit!r}, and scene.unit is {unit}; expected"
                f" the same; type scene.unit={stated}, or scene.unit=not_stated"
            )
        white = self.white_cd_m2
        if white is None and self.unit == units.NOT_STATED:
            white = content.white_cd_m2
            if white is not None and not 0 < white < math.inf:
                raise UnitError(
                    f"{self.path} states whiteLuminance {white:g}; expected more than 0 cd/m2; type"
                    " for example scene.white_cd_m2=300, the luminance of (1, 1, 1), or"
                    " scene.unit=cd/m2"
                )
        if content.wavelength_nm is None:
            return self._white_of_colours(content, unit, white)
        if unit in units.SPECTRAL:
            self._refuse_white(unit)
            return units.SPECTRAL[unit]
        if unit == units.REFLECTANCE and white is not None:
            return white
        raise ConfigError(
            f"the unit of the cube {self.path} is "
            + ("not stated" if unit is None else f"{unit}")
            + "; expected spectral radiance, or reflectance with the luminance of white; type"
            " scene.unit=W/m2/sr/nm, or scene.unit=reflectance scene.white_cd_m2=500"
        )

    def _stated_unit(self, content: Content) -> str | None:
        """Return the unit that the file states; None if it states none, or one in a spelling that
        is not known while the scene states the unit.

        Raises
        ------
        UnitError : the file states an unknown unit, and the scene states none.
        """
        if content.unit is None:
            return None
        if self.unit != units.NOT_STATED and not units.is_known(content.unit):
            return None
        return units.checked_unit(content.unit, self.path)

    def _white_of_colours(self, content: Content, unit: str | None, white: float | None) -> float:
        if unit == units.LUMINANCE:
            self._refuse_white(unit)
            if content.codes:
                raise ConfigError(
                    f"{self.path} holds {content.codes} codes, and the unit is {unit}; expected"
                    " floating-point numbers in cd/m2; save it as float32, or type"
                    " scene.unit=not_stated scene.white_cd_m2=300, the luminance of the largest"
                    " code"
                )
            return 1.0
        if unit in (None, units.REFLECTANCE) and white is not None:
            return white
        wrong = "not stated" if unit is None else f"{unit}"
        raise ConfigError(
            f"the unit of {self.path} is {wrong}; expected the luminance of (1, 1, 1), or values in"
            " cd/m2; type for example scene.white_cd_m2=300, or scene.unit=cd/m2"
        )

    def _refuse_white(self, unit: str) -> None:
        if self.white_cd_m2 is not None:
            raise ConfigError(
                f"white_cd_m2 is {self.white_cd_m2:g} and the unit is {unit}; expected one of them;"
                " type scene.white_cd_m2=null"
            )

    def _check_colours(self, content: Content) -> None:
        if (content.channels == XYZ_CHANNELS) != (self.primaries == "xyz"):
            if len(content.channels) == 3:
                right = "xyz" if content.channels == XYZ_CHANNELS else "srgb"
                raise ConfigError(
                    f"{self.path} has the channels {', '.join(content.channels)}, and"
                    f" scene.primaries is {self.primaries}; type scene.primaries={right}"
                )
        if content.chromaticities is None or len(content.channels) != 3 or self.primaries == "xyz":
            return
        name = named(content.chromaticities)
        if name != self.primaries:
            hint = f"type scene.primaries={name}" if name else "convert it to one of these"
            raise UnitError(
                f"{self.path} states chromaticities that are not those of {self.primaries};"
                f" expected one of {', '.join(CHROMATICITIES)} with a D65 white; {hint}"
            )

    def _white(self, bands: np.ndarray, name: str | None = None) -> np.ndarray:
        """Return the spectrum (wavelength,), W m-2 sr-1 nm-1, of an illuminant whose bands hold
        1 cd/m2.
        """
        relative = band_means(illuminant(name or self.spectrum), bands)
        unit = float(luminance(relative, bands))
        share = unit / _luminance_of(name or self.spectrum)
        if not share >= LEAST_SHARE:
            raise ConfigError(
                f"bands {bands[0]:g}-{bands[-1]:g} nm hold {share:.1g} of the luminance of"
                f" {name or self.spectrum}; expected at least {LEAST_SHARE:g}, because colours need"
                " visible bands; type scene.first_nm=400 scene.last_nm=700"
            )
        return np.asarray(relative / unit)

    def _reflectances(self) -> np.ndarray:
        bands = self.bands_nm()
        return primary_reflectances(bands, self._white(bands, "D65"))

    def _lifted(self, planes: np.ndarray, content: Content, bands: np.ndarray) -> np.ndarray:
        """Return the spectra (wavelength, y, x) of colours (channel, y, x) in cd/m2."""
        white = self._white(bands)
        luminance_in_file = luminance_of(planes, content.channels, self.primaries)
        if content.channels == LUMINANCE_CHANNELS:
            ledger.left_out(
                "spectra of a file of luminance",
                f"every pixel has the spectrum {self.spectrum}",
                1.0,
                "relative, of a band",
            )
            cube = (white[:, None, None] * luminance_in_file).astype(np.float32)
        else:
            rgb = linear_srgb(planes, self.primaries)
            if rgb.moved:
                ledger.left_out(
                    f"saturation of {rgb.moved} pixels beyond the gamut of sRGB",
                    "mixed with white of the same luminance",
                    rgb.most,
                    "share of white",
                )
            ledger.left_out(
                "true spectra of RGB values",
                "the smoothest spectra of the same colours are used (Mallett, Yuksel 2019)",
                LIFT_ERROR,
                "relative, of a camera's channels: rms of 24 patches in D65",
            )
            cube = spectra(rgb.rgb, luminance_in_file, self._reflectances() * white, bands)
        _state_luminance(luminance(cube, bands), luminance_in_file)
        return cube

    def _cube(self, content: Content, scale: float, bands: np.ndarray) -> np.ndarray:
        """Return the spectra (light_group, wavelength, y, x) of a cube."""
        stated = self._stated_unit(content)
        of_band = np.full(len(bands), scale)
        if units.REFLECTANCE in (self.unit, stated):
            # Reflectance may have bands beyond the visible, where white has no luminance.
            of_band = scale * band_means(illuminant(self.spectrum), bands)
            of_band = of_band / _luminance_of(self.spectrum)
        ledger.error(2.0**-24, "relative", "bound", "the file's spectra, rounded to float32")
        return (content.values * of_band[:, None, None]).astype(np.float32)

    def _dataset(self, cube: np.ndarray, content: Content, bands: np.ndarray) -> xr.Dataset:
        width, height, projection = self.camera_field()
        rows, columns = cube.shape[2:]
        data = scene_radiance(
            cube,
            content.groups,
            bands,
            centres(columns, width),
            centres(rows, height),
            (width, height),
            projection,
        )
        pitch = width / columns
        data.attrs.update(objects=[], lamps=[], pitch_x=pitch, pitch_y=pitch)
        return data


@lru_cache
def _luminance_of(spectrum: str) -> float:
    """Return the luminance of an illuminant, on the scale of `illuminant`."""
    return float(luminance(band_means(illuminant(spectrum), VISIBLE_NM), VISIBLE_NM))


def _state_luminance(luminance_made: np.ndarray, luminance_in_file: np.ndarray) -> None:
    """Record the largest relative difference between the luminance (y, x) of the spectra and that
    of the file.
    """
    lit = luminance_in_file > 0
    off = np.abs(luminance_made[lit] / luminance_in_file[lit] - 1).max() if lit.any() else 0.0
    ledger.error(
        max(float(off), 2.0**-24),
        "relative",
        "measured",
        "luminance of the file's pixels, kept by their spectra in float32: largest difference",
    )
