"""Check of captures: variables, attributes, dimensions and values that later steps need."""

from __future__ import annotations

import numpy as np
import xarray as xr

from isethdr_core.errors import UnitError, did_you_mean

from .electrons import PER_CAPTURE
from .fixed_pattern import check_device_spread
from .nonlinear_response import check_responses

# {variable: dimensions}
ARRAYS = {
    "raw": ("capture", "y", "x"),
    "saturated": ("capture", "y", "x"),
    "filter": ("y", "x"),
    "quantum_efficiency": ("capture", "channel", "wavelength"),
}
VARIABLES = (*ARRAYS, *PER_CAPTURE, "wavelength", "x", "y")
ATTRIBUTES = ("pitch_um", "focal_length_mm", "throughput_sr", "falloff")
FALLOFFS = ("cos4", "none", "table")


def check_captures(captures: xr.Dataset) -> None:
    """Raise UnitError unless `captures` has everything that docs/reference/contracts.md lists, with
    valid values.
    """
    _check_contents(captures)
    _check_optics(captures)
    _check_codes(captures)
    _check_charges(captures)
    _check_channels(captures)
    _check_companding(captures)
    check_responses(captures)
    check_device_spread(captures)


def _check_contents(captures: xr.Dataset) -> None:
    """Refuse captures that lack a variable or an attribute, have other dimensions, or are empty."""
    present = set(captures.variables) if isinstance(captures, xr.Dataset) else set()
    for name in VARIABLES:
        if name not in present:
            raise UnitError(
                f"captures lack {name!r}; expected what a sensor returns"
                " (docs/reference/contracts.md, Captures)"
            )
    for name in ATTRIBUTES:
        if name not in captures.attrs:
            raise UnitError(
                f"captures lack the attribute {name!r}; the sensor copies it from the light"
            )
    for name, dims in ARRAYS.items():
        found = tuple(captures[name].dims)
        if found != dims:
            raise UnitError(f"captures have {name} with dims {found}; expected {dims}")
    if captures["raw"].size == 0:
        raise UnitError("captures are empty; expected at least one capture and one pixel")


def _check_optics(captures: xr.Dataset) -> None:
    """Refuse attributes of the lens from which radiance cannot be computed."""
    falloff = captures.attrs["falloff"]
    if falloff not in FALLOFFS:
        raise UnitError(f"falloff {falloff!r} is unknown{did_you_mean(falloff, FALLOFFS)}")
    for name in ("throughput_sr", "focal_length_mm"):
        value = captures.attrs[name]
        if not (np.ndim(value) == 0 and np.isfinite(value) and value > 0):
            raise UnitError(
                f"captures have the attribute {name} = {value!r}; expected a finite number above 0"
            )


def _check_codes(captures: xr.Dataset) -> None:
    """Refuse codes that are not finite, and a top that is not above the black level."""
    black_dn = captures["black_dn"].values
    top_dn = captures["top_dn"].values
    if not np.all(np.isfinite(black_dn)):
        raise UnitError(
            f"captures have black_dn = {black_dn}; expected finite DN with the top above the black"
            " level"
        )
    if not np.all(np.isfinite(captures["raw"].values)):
        raise UnitError("raw holds NaN or infinite values; expected finite DN")
    if not np.all(top_dn > black_dn):
        raise UnitError(
            f"captures have top_dn = {top_dn}, black_dn = {black_dn}; expected a top above the"
            " black level"
        )


def _check_charges(captures: xr.Dataset) -> None:
    """Refuse exposures, gains, areas and noise that no reading can have."""
    for name in ("exposure_s", "gain_dn_per_e", "area_m2"):
        values = captures[name].values
        if not np.all((values > 0) & np.isfinite(values)):
            raise UnitError(f"captures have {name} = {values}; expected finite values above 0")
    for name in ("read_noise_e", "dark_e", "quantisation_e"):
        values = captures[name].values
        if not np.all((values >= 0) & np.isfinite(values)):
            raise UnitError(f"captures have {name} = {values}; expected electrons, 0 or above")


def _check_channels(captures: xr.Dataset) -> None:
    """Refuse filters without a quantum efficiency, and efficiencies that no pixel can have."""
    efficiency = captures["quantum_efficiency"].values
    if not np.all((efficiency >= 0) & np.isfinite(efficiency)) or not efficiency.any():
        raise UnitError(
            "captures have a quantum_efficiency below 0, not finite, or 0 throughout; expected"
            " electrons per photon, 0 to 1"
        )
    last = captures["filter"].values.max()
    channels = captures.sizes["channel"]
    if last >= channels:
        raise UnitError(
            f"filter holds channel {last}; expected 0..{channels - 1}, an index into `channel`"
        )


def _check_companding(captures: xr.Dataset) -> None:
    """Refuse a table that cannot be inverted: incomplete, too short, or not increasing."""
    present = [name for name in ("companding_dn", "companding_linear_dn") if name in captures]
    if not present:
        return
    if len(present) == 1:
        raise UnitError(
            f"captures have {present[0]} alone; expected companding_dn and companding_linear_dn, or"
            " neither"
        )
    for code, linear in zip(
        captures["companding_dn"].values, captures["companding_linear_dn"].values
    ):
        finite = np.isfinite(code) & np.isfinite(linear)
        if (
            finite.sum() < 2
            or np.any(np.diff(code[finite]) <= 0)
            or np.any(np.diff(linear[finite]) <= 0)
        ):
            raise UnitError(
                "a companding table does not rise from entry to entry; expected at least two rising"
                " pairs of companding_dn and companding_linear_dn"
            )
