"""The content of a picture file, before its unit is applied."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, UnitError

LUMINANCE_CHANNELS = ("Y",)
RGB_CHANNELS = ("R", "G", "B")
XYZ_CHANNELS = ("X", "Y", "Z")
SAME_NM = 0.01  # largest difference of equal wavelengths, nm; files round theirs


@dataclass(frozen=True)
class Content:
    """The values of a file, and what the file states about them.

    Parameters
    ----------
    values : (light_group, channel, y, x); channels are colours, or bands where `wavelength_nm` is
        set. Integers stay integers.
    channels : names of the colours: Y, or R, G, B, or X, Y, Z; empty for bands.
    wavelength_nm : centres of the bands, nm, rising; None for colours.
    unit : unit of the values as the file spells it; None: not stated.
    white_cd_m2 : luminance of (1, 1, 1) that the file states, cd/m2; None: not stated.
    chromaticities : (x, y) of red, green, blue and white that the file states; None: not stated.
    groups : names of the light groups.
    codes : type of the integers that the file holds as colours, such as uint16; "": no integers.
    zeroed, most_negative : number of negative values set to 0, and the most negative of them.
    """

    values: np.ndarray
    channels: tuple[str, ...] = ()
    wavelength_nm: tuple[float, ...] | None = None
    unit: str | None = None
    white_cd_m2: float | None = None
    chromaticities: tuple[float, ...] | None = None
    groups: tuple[str, ...] = ("picture",)
    codes: str = ""
    zeroed: int = 0
    most_negative: float = 0.0


@dataclass(frozen=True)
class Wanted:
    """Selection of what is read from a file.

    Parameters
    ----------
    channels : names of one luminance channel, or of red, green and blue; empty: the usual names.
    wavelength_nm : centres of the bands of a cube, nm, if its file does not state them.
    variable : name of the array, or of the part of an EXR, in a file with several; empty: the only
        one that serves.
    """

    channels: tuple[str, ...] = ()
    wavelength_nm: tuple[float, ...] = ()
    variable: str = ""


def plain_array(values: np.ndarray, selection: Wanted, path: Path) -> Content:
    """Return the content of an array without names of its axes.

    Two axes are luminance, (y, x). Three axes are colours, (y, x, 3). If `selection` names
    wavelengths, three axes are bands, and the band axis is the first or the last.

    Parameters
    ----------
    values : the array, of two or three axes.
    selection : wavelengths of the bands, where it has bands.
    path : path of the file, for messages.

    Raises
    ------
    UnitError : the axes fit none of these.
    """
    bands = selection.wavelength_nm
    shape = " x ".join(map(str, values.shape))
    if values.dtype.kind not in "fiu":
        raise UnitError(f"{path} holds {values.dtype} values; expected real numbers")
    if values.size == 0:
        raise UnitError(f"{path} is empty: {shape}; expected at least one pixel")
    if values.ndim == 2 and not bands:
        return Content(values[None, None], LUMINANCE_CHANNELS)
    if values.ndim == 3 and bands:
        return Content(_bands_first(values, bands, path)[None], wavelength_nm=bands)
    if values.ndim == 3 and values.shape[2] == 1:
        return Content(values[None, None, :, :, 0], LUMINANCE_CHANNELS)
    if values.ndim == 3 and values.shape[2] == 3:
        return Content(np.moveaxis(values, 2, 0)[None], RGB_CHANNELS)
    raise UnitError(
        f"{path} is an array of {shape}; expected (y, x) for luminance, (y, x, 3) for RGB, or a"
        " cube whose bands are stated; type for example 'scene.wavelength_nm=[400,410,420]'"
    )


def _bands_first(values: np.ndarray, bands: tuple[float, ...], path: Path) -> np.ndarray:
    count = len(bands)
    first = values.shape[0] == count
    last = values.shape[2] == count
    if first == last:
        why = "both its first and its last axis" if first else "neither its first nor last axis"
        raise UnitError(
            f"{path} is an array of {' x '.join(map(str, values.shape))}; scene.wavelength_nm names"
            f" {count} bands, and {why} has that length; expected (wavelength, y, x) or (y, x,"
            " wavelength)"
        )
    return values if first else np.moveaxis(values, 2, 0)


def refuse_other_bands(content: Content, selection: Wanted, path: Path) -> None:
    """Refuse wavelengths of the scene that contradict the file.

    Parameters
    ----------
    content : content of the file, with its bands in the order of the file.
    selection : wavelengths that the scene states; empty: none.
    path : path of the file, for messages.

    Raises
    ------
    UnitError : the file holds colours, or states other wavelengths.
    """
    wanted = selection.wavelength_nm
    found = content.wavelength_nm
    if not wanted or (
        found is not None and len(found) == len(wanted) and np.allclose(found, wanted, 0, SAME_NM)
    ):
        return
    if found is None:
        holds = f"holds the colours {', '.join(content.channels)}"
    else:
        holds = f"states {len(found)} bands, {found[0]:g} to {found[-1]:g} nm"
    raise UnitError(
        f"{path} {holds}, and scene.wavelength_nm names {len(wanted)} bands, {wanted[0]:g} to"
        f" {wanted[-1]:g} nm; expected none, or those of the file; type 'scene.wavelength_nm=[]' if"
        " those of the file are right, or correct them in the file"
    )


def sorted_bands(content: Content, path: Path) -> Content:
    """Return a cube with its bands in rising order.

    Raises
    ------
    UnitError : two bands have the same wavelength.
    """
    if content.wavelength_nm is None:
        return content
    nm = np.asarray(content.wavelength_nm, float)
    order = np.argsort(nm)
    if np.any(np.diff(nm[order]) <= 0):
        raise UnitError(
            f"{path} has the wavelength {nm[order][1:][np.diff(nm[order]) <= 0][0]:g} nm twice;"
            " expected one band for each wavelength"
        )
    values = content.values if np.all(np.diff(order) == 1) else content.values[:, order]
    return replace(content, values=values, wavelength_nm=tuple(nm[order].tolist()))


def unreadable(path: Path, kind: str, why: object) -> CatalogError:
    """Return the error for a file that is damaged, or has another format than its name says.

    Parameters
    ----------
    path : path of the file.
    kind : name of the format, for the message.
    why : error or text with the reason.
    """
    reason = " ".join(str(why).split())
    return CatalogError(f"{path} is not a readable {kind} file, or is cut off ({reason})")
