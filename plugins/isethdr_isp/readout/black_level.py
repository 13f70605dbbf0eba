"""Black level: as the sensor states it, or measured on its optical black rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm, poisson

from isethdr_core import ledger
from isethdr_core.errors import UnitError

from .electrons import linear_dn
from .fixed_pattern import device_spread

if TYPE_CHECKING:
    import xarray as xr

BLACK = "optical_black"  # variable of the captures, (capture, black_row, x) DN
# A pixel further from the others than this many standard deviations holds foreign charge, or is
# hot. Normal noise is as far in one of two million pixels.
OUTLIER = 5.0
# Charge only adds. If more than this share of the pixels is too low, the others hold charge. Of
# random telegraph noise, 0.5 % is too low at most.
LOW_SHARE = 0.05
# Drift of black levels, as a share of the range (assumption). A level further from the stated one
# cannot be told from charge in nearly all black pixels.
DRIFT = 0.02
# A converter has at most this many codes. A larger range is that of several readings, combined on
# the chip; the black level belongs to one of them.
CONVERTER_CODES = 2**14
ROUNDS = 20  # limit of the search for the pixels that count; it settles after a few rounds
ROUNDING = 1e-6  # relative error of values that are equal apart from rounding to float32
FIT_ROUNDS = 10  # rounds of the fit of rows and columns to pixels with gaps


def with_black_level(captures: xr.Dataset, source: str) -> xr.Dataset:
    """Return captures with `black_dn` from the given source.

    The mean linear DN of a capture's optical black pixels is the sum of black level and mean dark
    charge. The dark charge that the sensor states (`dark_e`) is subtracted. Pixels that hold charge
    of a lamp, and hot pixels, are left out (`counting_pixels`). The ledger gets the largest
    standard error of the captures and the number of pixels left out. If most pixels of a capture
    are of no use, or the level is further from the stated one than noise and drift explain, it gets
    the difference to the stated black level, too.

    Parameters
    ----------
    captures : captures Dataset.
    source : "stated", which returns the captures unchanged, or "optical".

    Raises
    ------
    UnitError : `source` is "optical", and the captures have no optical black pixels.
    """
    if source == "stated":
        return captures
    if BLACK not in captures or not captures[BLACK].size:
        raise UnitError(
            f"captures have no {BLACK!r}, on which isp.black=optical measures; expected a sensor"
            " with sensor.black_rows above 0; or type isp.black=stated"
        )
    raw = captures[BLACK].values.astype(float)
    gain = captures["gain_dn_per_e"].values
    linear = np.array([linear_dn(captures, i, codes)[0] for i, codes in enumerate(raw)])
    allowed = [_allowed_dn(captures, i, codes) for i, codes in enumerate(raw)]
    used = np.array([counting_pixels(v, *dn) for v, dn in zip(linear, allowed)])
    kept = np.where(used, linear, np.nan)
    black = np.nanmean(kept, axis=(1, 2)) - gain * captures["dark_e"].values
    moved_e = (black - captures["black_dn"].values) / gain
    error_e = np.array([standard_error(values) for values in kept]) / gain
    left_out = (~used).sum(axis=(1, 2))
    drift_e = np.array([_drift_e(captures, i) for i in range(len(raw))])
    # with the code step at the stated level: at charge, steps of companded codes are larger
    noise = [_allowed_dn(captures, i, _stated_code(captures, i)) for i in range(len(raw))]
    limit_e = np.array(noise).max(axis=1) / gain + drift_e
    _state(float(error_e.max()), left_out, linear[0].size, moved_e, limit_e)
    moved = black - captures["black_dn"].values
    corrected = captures.assign(black_dn=captures["black_dn"].copy(data=black))
    if "response_dn" in captures:
        table = captures["response_dn"]
        corrected = corrected.assign(response_dn=table.copy(data=_moved(table.values, moved)))
    return corrected


def counting_pixels(values: np.ndarray, below: float, above: float) -> np.ndarray:
    """Return a mask (black_row, x) of the optical black pixels that the black level is measured on.

    A pixel counts if its distance to the median of the counting pixels is below `OUTLIER` robust
    standard deviations of these pixels (from the median of the distances), or below the distance
    that the stated noise allows. The rule is symmetric, so it does not move the mean of symmetric
    noise by more than a small part of its standard error. The median holds while less than half of
    the pixels are outliers. If the pixels far below it are too many for noise, the search continues
    among them.

    Parameters
    ----------
    values : (black_row, x) linear DN.
    below, above : distances that the stated noise allows at least, linear DN.
    """
    use = np.ones(values.shape, bool)
    for _ in range(ROUNDS):
        centre = float(np.median(values[use]))
        distance = np.abs(values[use] - centre)
        rounding = ROUNDING * abs(centre)
        measured = OUTLIER * float(np.median(distance)) / norm.ppf(0.75) + rounding
        low = values < centre - max(measured, below)
        if low.mean() > LOW_SHARE:
            found = low
        else:
            found = ~low & (values <= centre + max(measured, above))
        if np.array_equal(found, use):
            break
        use = found
    return use


def _allowed_dn(captures: xr.Dataset, i: int, raw: np.ndarray) -> tuple[float, float]:
    """Return how far below and above the median the stated noise brings a black pixel of capture
    `i`, linear DN.

    The sum of `OUTLIER` standard deviations of noise and offsets, five code steps at least, and of
    the dark charge with the same probability. At few electrons, dark charge is far from normal:
    without its own limit, a pixel with one electron would be left out.
    """
    gain = float(captures["gain_dn_per_e"].values[i])
    spread = device_spread(captures, i)
    dark_e = float(captures["dark_e"].values[i])
    noise_e = np.sqrt(
        float(captures["read_noise_e"].values[i]) ** 2
        + spread.dark_spread_e**2
        + spread.dsnu_e**2
        + spread.column_e**2
        + spread.row_e**2
    )
    rest_e = OUTLIER * max(float(noise_e), _step_e(captures, i, raw))
    tail = float(norm.sf(OUTLIER))
    dark_below_e = dark_e - float(poisson.ppf(tail, dark_e)) if dark_e else 0.0
    dark_above_e = float(poisson.isf(tail, dark_e)) - dark_e if dark_e else 0.0
    return gain * (rest_e + max(dark_below_e, 0.0)), gain * (rest_e + max(dark_above_e, 0.0))


def _stated_code(captures: xr.Dataset, i: int) -> np.ndarray:
    """Return the code of the stated black level of capture `i`, (1,) DN; not rounded."""
    black_dn = captures["black_dn"].values[i : i + 1].astype(float)
    if "companding_dn" not in captures:
        return black_dn
    code, linear = (
        captures[name].values[i].astype(float) for name in ("companding_dn", "companding_linear_dn")
    )
    finite = np.isfinite(code) & np.isfinite(linear)
    return np.interp(black_dn, linear[finite], code[finite])


def _step_e(captures: xr.Dataset, i: int, raw: np.ndarray) -> float:
    """Return the step of the code of capture `i` at the codes `raw` (median), electrons; 0 if
    nothing is rounded.
    """
    dn_per_code = float(np.median(linear_dn(captures, i, raw)[1]))
    return dn_per_code * float(captures["quantisation_e"].values[i])


def _drift_e(captures: xr.Dataset, i: int) -> float:
    """Return how far the black level of capture `i` may drift, electrons. It does not depend on the
    black pixels, which may be full of charge, where steps of companded codes are larger.
    """
    gain = float(captures["gain_dn_per_e"].values[i])
    range_e = float((captures["top_dn"] - captures["black_dn"]).values[i]) / gain
    step_e = _step_e(captures, i, np.zeros(1))
    return DRIFT * (min(range_e, CONVERTER_CODES * step_e) if step_e else range_e)


def _state(
    error_e: float, left_out: np.ndarray, pixels: int, moved_e: np.ndarray, limit_e: np.ndarray
) -> None:
    """State the error of the black level, how many pixels were left out, and whether the level is
    in doubt.

    Parameters
    ----------
    error_e : largest standard error of the captures, electrons.
    left_out : number of pixels left out of each capture (capture,).
    pixels : number of optical black pixels of a capture.
    moved_e : measured minus stated black level (capture,), electrons.
    limit_e : largest difference that noise and drift explain (capture,), electrons.
    """
    if left_out.any():
        outliers = f", up to {left_out.max()} per capture left out (charge of lamps, hot pixels)"
    else:
        outliers = ""
    ledger.error(
        error_e,
        "electrons",
        "statistical",
        f"black level measured on {pixels} optical black pixels{outliers}, standard error",
    )
    far = np.abs(moved_e) > limit_e
    most = (2 * left_out > pixels) & ~far
    doubts = (
        (
            far,
            "further apart than noise and drift explain; the optical black pixels hold charge of"
            " lamps, or the sensor states a wrong level or dark charge; type isp.black=stated if"
            " the stated values are right",
        ),
        (
            most,
            "more than half of the optical black pixels hold charge of lamps or are hot;"
            " isp.black=stated does not use them",
        ),
    )
    for doubtful, reason in doubts:
        if doubtful.any():
            ledger.error(
                float(np.abs(moved_e[doubtful]).max()),
                "electrons",
                "measured",
                f"black level against the stated one: {reason}",
                key="doubtful black level",
            )


def standard_error(values: np.ndarray) -> float:
    """Return the standard error of the mean of black pixels, in the unit of the values.

    Parameters
    ----------
    values : (black_row, x), any unit; NaN: a pixel that does not count.

    Notes
    -----
    All pixels of a row share its offset, and all pixels of a column share theirs. The variance of
    the mean therefore follows from the mean squares of rows, columns and residuals (two-way
    analysis of variance): (rows + columns - residuals) / pixels. The mean squares of rows and
    columns count at least as those of the residuals. The offset of a single row or column cannot be
    told from the black level, and is not included. Pixels that do not count get the values of the
    fit of rows and columns to the others; they add no freedom to the residuals.
    """
    known = np.isfinite(values)
    known = known[known.any(axis=1)][:, known.any(axis=0)]
    values = values[np.isfinite(values).any(axis=1)][:, np.isfinite(values).any(axis=0)]
    rows, columns = values.shape
    used = int(known.sum())
    freedom = used - rows - columns + 1
    if min(rows, columns) < 2 or freedom < 1:
        return float(np.nanstd(values) / np.sqrt(used))
    values = _filled(values, known)
    mean = values.mean()
    of_row = values.mean(axis=1, keepdims=True) - mean
    of_column = values.mean(axis=0, keepdims=True) - mean
    residual = np.sum((values - mean - of_row - of_column) ** 2) / freedom
    by_row = max(columns * np.sum(of_row**2) / (rows - 1), residual)
    by_column = max(rows * np.sum(of_column**2) / (columns - 1), residual)
    return float(np.sqrt((by_row + by_column - residual) / used))


def _filled(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return values (black_row, x) in which unknown pixels have the sum of the offsets of their row
    and their column.
    """
    if known.all():
        return values
    out = np.where(known, values, np.nanmean(values))
    for _ in range(FIT_ROUNDS):
        fit = out.mean(axis=1, keepdims=True) + out.mean(axis=0, keepdims=True) - out.mean()
        out = np.where(known, values, fit)
    return out


def _moved(dn: np.ndarray, moved_dn: np.ndarray) -> np.ndarray:
    """Return response tables moved with the black level, linear DN (capture, entry).

    A table ends at its former last entry at most. Saturated pixels have this code or a larger one
    wherever the black level is. Further entries become NaN, as those that pad a table.

    Parameters
    ----------
    dn : linear DN of the tables (capture, entry), increasing.
    moved_dn : new black level minus the former one (capture,), DN.
    """
    end = np.fmax.reduce(dn, axis=1)[:, None]
    moved = dn + moved_dn[:, None]
    behind_end = np.cumsum(moved >= end, axis=1) > 1
    return np.where(behind_end, np.nan, np.minimum(moved, end))
