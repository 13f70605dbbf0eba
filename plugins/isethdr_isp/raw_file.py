"""Raw file: one capture as a digital negative (DNG 1.4, a TIFF/EP), for other raw developers.

The samples are the DN. Black, white, filter array, colour matrix, noise and exposure are tags of
the file. Figures without a tag, such as electrons per DN and throughput, are in the description as
JSON.
"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import UnitError
from isethdr_core.physics.colour.colour_spaces import colour_matrix
from isethdr_core.physics.photometry import xyz_weights

from .demosaic.interpolation import array_period
from .readout.captures_check import check_captures
from .readout.electrons import chosen, readouts
from .spectra import light, radiances

if TYPE_CHECKING:
    import xarray as xr

# numbers of filters in the tag CFAPlaneColor; C is clear, like W
COLOURS = {
    "R": 0,
    "G": 1,
    "B": 2,
    "M": 4,
    "Y": 5,
    "W": 6,
    "C": 6,
}
# values of the tag PhotometricInterpretation: filter array; one channel in TIFF; one channel in DNG
ARRAY = 32803
GREY = 1
LINEAR = 34892
KIND = 262  # number of the tag PhotometricInterpretation
D65 = 21  # daylight, value of the tag CalibrationIlluminant1
LARGEST = 65535  # largest sample, DN
COMBINED = "combined"  # name of the capture into which a chip combines all of its readings


def write_dng(captures: xr.Dataset, path: Path, capture: str = "") -> Path:
    """Write one capture as DNG; return the path.

    Parameters
    ----------
    captures : captures Dataset.
    path : file to write, usually ending in .dng.
    capture : name of the capture; empty takes the first.

    Raises
    ------
    UnitError : samples are no whole DN of 16 bits or less, a DNG has no name for the filters, or
        the response is nonlinear. Without `response_dn`, `response_e` and `response_variance_e2`
        (`captures.drop_vars`), the codes of a nonlinear response are written as if it were linear.
    """
    import tifffile

    check_captures(captures)
    single = chosen(captures, capture)
    names = [str(name) for name in single["channel"].values]
    raw = single["raw"].values[0]
    _check(single, names, raw)
    mono = len(names) == 1
    with tifffile.TiffWriter(path, byteorder="<") as file:
        file.write(
            raw.astype(np.uint16),
            photometric=GREY if mono else ARRAY,
            description=_description(single),
            software="isethdr",
            metadata=None,
            extratags=[(code, *entry, True) for code, *entry in sorted(tags(single, names, mono))],
        )
    if mono:
        # tifffile writes LINEAR only for three channels, so the tag is changed afterwards
        with tifffile.TiffFile(path, mode="r+") as file:
            file.pages[0].tags[KIND].overwrite(LINEAR)
    return Path(path)


def tags(capture: xr.Dataset, names: list[str], mono: bool) -> list[tuple]:
    """Return (code, type, count, value) of every tag of one capture.

    Parameters
    ----------
    capture : a captures Dataset with one capture.
    names : name of each channel.
    mono : whether every pixel samples the same channel.
    """
    [read] = readouts(capture, light("daylight", capture.wavelength.values))
    get = {
        name: float(capture[name].values[0])
        for name in ("exposure_s", "gain_dn_per_e", "black_dn", "top_dn")
    }
    full_e = (get["top_dn"] - get["black_dn"]) / get["gain_dn_per_e"]
    neutral = read.sensitivity / read.sensitivity.max()
    # variance = S x + O for samples x of 0..1, where the charge with shot noise includes the dark
    # charge
    noise = [1 / full_e, float(np.median(read.read_var_e2)) / full_e**2] * len(names)
    ny, nx = capture["filter"].shape
    entries = [
        (50706, "B", 4, bytes([1, 4, 0, 0])),
        (50707, "B", 4, bytes([1, 3, 0, 0])),
        (50708, "s", 0, "isethdr simulated camera"),
        (271, "s", 0, "isethdr"),
        (272, "s", 0, "isethdr simulated camera"),
        (274, "H", 1, 1),
        (50714, "2I", 1, _ratio(get["black_dn"])),
        (50717, "I", 1, int(get["top_dn"])),
        (50829, "I", 4, (0, 0, ny, nx)),
        (51041, "d", len(noise), tuple(noise)),
        (33434, "2I", 1, _ratio(get["exposure_s"])),
        (37386, "2I", 1, _ratio(float(capture.attrs["focal_length_mm"]))),
    ]
    if "f_number" in capture.attrs:
        entries.append((33437, "2I", 1, _ratio(float(capture.attrs["f_number"]))))
    if "companding_dn" in capture:
        knees = np.array(
            [capture[name].values[0] for name in ("companding_dn", "companding_linear_dn")], float
        )
        knees = knees[:, np.isfinite(knees).all(0)]
        linear = np.interp(np.arange(int(knees[0, -1]) + 1), *knees)
        # the last knee may lie beyond the top, where no sample is
        table = np.minimum(np.rint(linear), LARGEST).astype(int)
        entries.append((50712, "H", len(table), tuple(table.tolist())))
    if not mono:
        cell = _cell(capture)
        order = planes_in_order(capture)
        names = [names[k] for k in order]
        response = read.response[order]
        neutral = neutral[order]
        letters = np.array(capture["channel"].values.tolist())[cell].ravel().tolist()
        entries += [
            (33421, "H", 2, cell.shape),
            (33422, "B", cell.size, bytes(COLOURS[name] for name in letters)),
            (50710, "B", len(names), bytes(COLOURS[name] for name in names)),
            (50711, "H", 1, 1),
            (50778, "H", 1, D65),
            (
                50721,
                "2i",
                3 * len(names),
                _ratios(camera_matrix(response, capture.wavelength.values)),
            ),
            (50728, "2I", len(names), _ratios(neutral)),
        ]
    return entries


def _cell(capture: xr.Dataset) -> np.ndarray:
    """Return the filters (row, column) of one cell of the array."""
    filters = capture["filter"].values
    return filters[tuple(slice(n) for n in array_period(filters))]


def planes_in_order(capture: xr.Dataset) -> list[int]:
    """Return the channels in the order of the file's planes.

    Raw developers expect green, which a cell contains twice, as the second of three planes. The
    channel that is sampled twice is therefore the second; four channels keep their order.
    """
    count = np.bincount(_cell(capture).ravel(), minlength=capture.sizes["channel"])
    order = list(range(len(count)))
    if len(order) == 3:
        twice = int(np.argmax(count))
        order.remove(twice)
        order.insert(1, twice)
    return order


def camera_matrix(response: np.ndarray, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the matrix (channel, 3) from XYZ to the channels of the camera. It is exact for white
    in daylight, and the least-squares solution over surfaces and lights otherwise.

    For a white in daylight with Y = 1, the strongest channel is 1.
    """
    samples = radiances(wavelength_nm)
    white = light("daylight", wavelength_nm)
    weights = xyz_weights(wavelength_nm)
    camera = response / (response @ white).max()
    return colour_matrix(samples @ weights.T, samples @ camera.T, weights @ white, camera @ white)


def _description(capture: xr.Dataset) -> str:
    numbers = {
        name: float(capture[name].values[0])
        for name in (
            "exposure_s",
            "gain_dn_per_e",
            "black_dn",
            "top_dn",
            "read_noise_e",
            "dark_e",
            "quantisation_e",
            "area_m2",
        )
    }
    numbers |= {
        name: float(capture.attrs[name])
        for name in ("throughput_sr", "pitch_um", "focal_length_mm")
        if name in capture.attrs
    }
    return json.dumps({"capture": str(capture["capture"].values[0]), **numbers})


def _check(capture: xr.Dataset, names: list[str], raw: np.ndarray) -> None:
    top = float(capture["top_dn"].values[0])
    # before the response, which belongs to the combined code alone
    if str(capture["capture"].values[0]) == COMBINED and top > LARGEST:
        raise UnitError(
            f"raw is a code up to {top:g} DN into which the chip combines its captures; a DNG holds"
            " whole DN of 16 bits; expected single captures; type sensor.combine_bits=0"
        )
    if "response_dn" in capture and np.isfinite(capture["response_dn"].values[0]).any():
        raise UnitError(
            "a DNG cannot hold a nonlinear response; expected a sensor whose DN are proportional to"
            " light; type for example sensor=bayer, or --to exr for the picture"
        )
    if len(names) > 1:
        _check_array(capture, names)
    _check_samples(raw, top)


def _check_samples(raw: np.ndarray, top: float) -> None:
    """Refuse samples that are no whole DN of 16 bits, and companded samples of more bits.

    Parameters
    ----------
    raw : samples (y, x).
    top : top of the range before companding, DN.
    """
    if not np.issubdtype(raw.dtype, np.integer):
        raise UnitError(
            f"raw is {raw.dtype}, from a sensor without a converter; a DNG holds whole DN of 16"
            " bits; expected whole DN; type sensor.bits=12, or sensor=bayer in place of a sensor"
            " without this field, such as ideal"
        )
    if raw.min() < 0 or raw.max() > LARGEST or not 0 < top <= LARGEST:
        raise UnitError(
            f"raw is {raw.dtype} up to {raw.max():g} with its top at {top:g} DN before companding;"
            f" a DNG holds whole DN of 16 bits; expected a top of {LARGEST} DN or less; type"
            " sensor.bits=16"
        )


def _check_array(capture: xr.Dataset, names: list[str]) -> None:
    """Refuse a filter array for which a DNG has no name, or that raw developers open with wrong
    filters.
    """
    unknown = [name for name in names if name not in COLOURS]
    if unknown:
        raise UnitError(
            f"a DNG has no name for filter {', '.join(unknown)}; expected some of"
            f" {', '.join(COLOURS)}; type for example sensor=bayer sensor.cfa=RGGB"
        )
    rows, columns = _cell(capture).shape
    if (rows, columns) != (2, 2) or len({COLOURS[name] for name in names}) not in (3, 4):
        raise UnitError(
            f"the filter array repeats after {rows} x {columns} pixels and holds"
            f" {', '.join(names)}; raw developers read a DNG of 2 x 2 pixels with three or four"
            " kinds of filters, or of one kind; type for example sensor=bayer sensor.cfa=RGGB"
        )


def _ratio(value: float) -> tuple[int, int]:
    """Return the numerator and denominator of a fraction near `value`; the denominator is at most
    10^9 below 0.001, at most 10^6 below 1000, and at most 1000 above.
    """
    largest = 10**6 if abs(value) < 1000 else 1000
    # short exposures; with 10^6 the shortest would become 0
    if abs(value) < 1e-3:
        largest = 10**9
    fraction = Fraction(value).limit_denominator(largest)
    return fraction.numerator, fraction.denominator


def _ratios(values: np.ndarray) -> tuple[int, ...]:
    return tuple(part for value in np.ravel(values) for part in _ratio(float(value)))
