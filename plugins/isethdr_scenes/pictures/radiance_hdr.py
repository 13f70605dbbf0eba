"""Radiance HDR: pictures of shared exponents (RGBE).

Format: Ward (1991), "Real pixels", Graphics Gems II, p. 80; header and run lengths as the
reference manual of Radiance describes them (file formats, "Picture file format").
A pixel (r, g, b, e) is ((r, g, b) + 0.5) x 2^(e - 136); e = 0 is black.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import UnitError

from .content import RGB_CHANNELS, Content, Wanted, unreadable

MAGIC = (b"#?RADIANCE", b"#?RGBE")
FORMAT = b"32-bit_rle_rgbe"
NEW_RUNS = (8, 0x7FFF)  # widths of scan lines that may be stored channel by channel
# (x, y) of red, green, blue and white of a file that states none; such files are taken as sRGB
OWN_PRIMARIES = (0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 1 / 3, 1 / 3)
SQUARE = 1e-3  # largest difference of the aspect ratio of square pixels from 1
SAME = 2e-3  # largest difference of equal chromaticities
EXPONENT_OFFSET = 136  # 128 of the exponent's code, 8 of the mantissa


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of an HDR file, linear RGB divided by the file's EXPOSURE and COLORCORR,
    with the PRIMARIES that it states.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds XYZE, pixels that are not square, or scan lines that do not run from the
        top left.
    """
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise unreadable(path, "Radiance HDR", f"it begins with {data[:10]!r}")
    head, blank, body = data.partition(b"\n\n")
    size, newline, body = body.partition(b"\n")
    if not (blank and newline):
        raise unreadable(path, "Radiance HDR", "its header has no end")
    exposure = _exposure(head, path)
    chromaticities = _chromaticities(head, path)
    height, width = _size(size, path)
    try:
        if height > len(body):  # a scan line has a byte or more
            raise IndexError
        pixels = _scan_lines(np.frombuffer(body, np.uint8), height, width)
    except (IndexError, MemoryError, OverflowError, ValueError):  # or a size beyond the memory
        raise unreadable(
            path, "Radiance HDR", f"it has fewer scan lines than {size.decode(errors='replace')}"
        ) from None
    mantissa = pixels[..., :3].astype(np.float32) + 0.5
    exponent = pixels[..., 3:].astype(np.int32)
    with np.errstate(over="ignore"):
        rgb = np.where(exponent > 0, np.ldexp(mantissa, exponent - EXPONENT_OFFSET), 0.0)
    planes = np.moveaxis(rgb / exposure, 2, 0)[None].astype(np.float32)
    return Content(planes, RGB_CHANNELS, chromaticities=chromaticities)


def _exposure(head: bytes, path: Path) -> np.ndarray:
    """Return the factors (3,) by which the values of red, green and blue were multiplied: EXPOSURE
    times COLORCORR, each the product of its lines.

    Raises
    ------
    CatalogError : a factor is no positive number.
    UnitError : the file holds XYZE, or pixels that are not square.
    """
    factors = {b"EXPOSURE": np.ones(1), b"COLORCORR": np.ones(3), b"PIXASPECT": np.ones(1)}
    for line in head.splitlines():
        key, _, value = line.partition(b"=")
        key = key.rstrip()  # indented lines are the headers of pictures that this one was made of
        if key == b"FORMAT" and value.strip() != FORMAT:
            raise UnitError(f"{path} holds {value.decode(errors='replace')}; expected RGBE")
        if key not in factors:
            continue
        try:
            numbers = np.array(value.split(), float)
        except ValueError:
            numbers = np.zeros(0)
        if numbers.shape != factors[key].shape or not np.all((numbers > 0) & (numbers < np.inf)):
            raise unreadable(path, "Radiance HDR", line.decode(errors="replace"))
        factors[key] = factors[key] * numbers
    if abs(factors[b"PIXASPECT"][0] - 1) > SQUARE:
        raise UnitError(
            f"{path} states PIXASPECT={factors[b'PIXASPECT'][0]:g}; expected square pixels;"
            " resample it"
        )
    exposure = factors[b"EXPOSURE"] * factors[b"COLORCORR"]
    if not np.all((exposure > 0) & (exposure < np.inf)):
        raise unreadable(path, "Radiance HDR", f"EXPOSURE={factors[b'EXPOSURE'][0]:g}")
    return exposure


def _chromaticities(head: bytes, path: Path) -> tuple[float, ...] | None:
    """Return the chromaticities that the header states; None for those of Radiance, or without."""
    stated: tuple[float, ...] | None = None
    for line in head.splitlines():
        key, _, value = line.partition(b"=")
        if key.rstrip() == b"PRIMARIES":
            try:
                stated = tuple(map(float, value.split()))
            except ValueError:
                stated = ()
            if len(stated) != len(OWN_PRIMARIES):
                raise unreadable(path, "Radiance HDR", line.decode(errors="replace"))
    if stated is None or np.abs(np.subtract(stated, OWN_PRIMARIES)).max() <= SAME:
        return None
    return stated


def _size(line: bytes, path: Path) -> tuple[int, int]:
    words = line.split()
    if len(words) != 4 or (words[0], words[2]) != (b"-Y", b"+X"):
        raise UnitError(
            f"{path} stores its scan lines as {line.decode(errors='replace')!r}; expected"
            " -Y <height> +X <width>, from the top left"
        )
    try:
        height = int(words[1])
        width = int(words[3])
    except ValueError:
        height = width = 0
    if height < 1 or width < 1:
        raise unreadable(path, "Radiance HDR", line.decode(errors="replace"))
    return height, width


def _scan_lines(data: np.ndarray, height: int, width: int) -> np.ndarray:
    """Return the bytes of all pixels, (y, x, 4).

    Raises
    ------
    IndexError : the data end early, or a run is longer than its line.
    """
    out = np.empty((height, width, 4), np.uint8)
    at = 0
    for row in range(height):
        new = NEW_RUNS[0] <= width <= NEW_RUNS[1] and data[at] == 2 and data[at + 1] == 2
        if new and (int(data[at + 2]) << 8 | int(data[at + 3])) == width:
            at = _channel_runs(data, at + 4, out[row])
        else:
            at = _pixel_runs(data, at, out[row])
    return out


def _channel_runs(data: np.ndarray, at: int, line: np.ndarray) -> int:
    """Fill one line that is stored channel by channel; return the start of the next line."""
    for channel in range(4):
        x = 0
        while x < len(line):
            count = int(data[at])
            repeats = count > 128
            count -= 128 * repeats
            values = data[at + 1 : at + 2] if repeats else data[at + 1 : at + 1 + count]
            if count == 0 or x + count > len(line) or len(values) < (1 if repeats else count):
                raise IndexError
            line[x : x + count, channel] = values
            x += count
            at += 1 + len(values)
    return at


def _pixel_runs(data: np.ndarray, at: int, line: np.ndarray) -> int:
    """Fill one line that is stored pixel by pixel; return the start of the next line.

    A pixel (1, 1, 1, n) repeats the last pixel n times.
    """
    x = shift = 0
    while x < len(line):
        pixel = data[at : at + 4]
        if len(pixel) < 4:
            raise IndexError
        at += 4
        if np.all(pixel[:3] == 1):
            count = int(pixel[3]) << shift
            if x == 0 or x + count > len(line):
                raise IndexError
            line[x : x + count] = line[x - 1]
            x += count
            shift += 8
        else:
            line[x] = pixel
            x += 1
            shift = 0
    return at
