"""Units of light that files may have."""

from __future__ import annotations

from typing import Literal

from isethdr_core.errors import UnitError

LUMINANCE = "cd/m2"
REFLECTANCE = "reflectance"
NOT_STATED = "not_stated"
Unit = Literal[
    "not_stated",
    "cd/m2",
    "W/m2/sr/nm",
    "W/m2/sr/um",
    "mW/m2/sr/nm",
    "uW/cm2/sr/nm",
    "reflectance",
]
# factors from units of spectral radiance to W m-2 sr-1 nm-1
SPECTRAL = {
    "W/m2/sr/nm": 1.0,
    "W/m2/sr/um": 1e-3,
    "mW/m2/sr/nm": 1e-3,
    "uW/cm2/sr/nm": 1e-2,
}
# other spellings in files, without blanks and signs of multiplication
SPELT = {
    "Wm-2sr-1nm-1": "W/m2/sr/nm",
    "W/(m2srnm)": "W/m2/sr/nm",
    "Wm-2sr-1um-1": "W/m2/sr/um",
    "W/(m2srum)": "W/m2/sr/um",
    "mWm-2sr-1nm-1": "mW/m2/sr/nm",
    "uWcm-2sr-1nm-1": "uW/cm2/sr/nm",
    "cdm-2": LUMINANCE,
    "1": REFLECTANCE,
}


SIGNS = str.maketrans(
    {
        **dict(zip("µμ²¹⁻−", "uu21--", strict=True)),
        **dict.fromkeys(" .*^·⋅"),
    }
)


def _plain(spelt: str) -> str:
    plain = spelt.translate(SIGNS)
    return SPELT.get(plain, plain)


def is_known(spelt: str) -> bool:
    """Return whether a unit, as a file spells it, is one of `Unit`."""
    return _plain(spelt) in (*SPECTRAL, LUMINANCE, REFLECTANCE)


def checked_unit(spelt: str, path: object) -> str:
    """Return a file's unit as `Unit` spells it.

    Raises
    ------
    UnitError : the unit is unknown.
    """
    unit = _plain(spelt)
    if not is_known(spelt):
        raise UnitError(
            f"{path} states the unit {spelt!r}; expected one of {LUMINANCE},"
            f" {', '.join(SPECTRAL)}, {REFLECTANCE}; type scene.unit=<unit> in its place"
        )
    return unit
