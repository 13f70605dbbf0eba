"""The weighted sum of light groups, and their luminance maps, read group by group in blocks of
bands.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..data import quantities
from ..data.temporal_modulation import stacked
from ..errors import ConfigError, UnitError, did_you_mean
from ..physics import photometry
from ..physics.detector.temporal_modulation import Modulation, constant
from ..uncertainty import ledger
from .modulation import check_groups

if TYPE_CHECKING:
    import xarray as xr

# number of bands in one inner chunk of a stored cube: a block decompresses each chunk once
BLOCK_BANDS = 8


def group_names(ds: xr.Dataset) -> list[str]:
    """Return the names of the light groups of a scene radiance Dataset after the checks that read
    no light.
    """
    quantities.check_scene_form(ds)
    names = [str(g) for g in ds.light_group.values]
    if len(set(names)) < len(names):
        raise UnitError(
            f"scene radiance names a light group twice: {', '.join(names)}; expected one cube per"
            " name"
        )
    return names


def all_weights(named: dict[str, float], others: float, groups: Sequence[str]) -> dict[str, float]:
    """Return the weight of every group of the scene.

    Parameters
    ----------
    named : {group: weight}; a group the scene lacks is an error unless its weight is 0 (it was not
        asked for).
    others : weight of the groups that `named` does not list.
    groups : names of the scene's light groups.

    Raises
    ------
    ConfigError : a weight names a group the scene does not have.
    """
    for name, weight in named.items():
        if name not in groups and weight != 0:
            raise ConfigError(
                f"the scene has no light group {name!r}{did_you_mean(name, groups)}; "
                f"type ~lighting.weights.{name} to leave it out"
            )
    return {g: float(named.get(g, others)) for g in groups}


def mix(
    ds: xr.Dataset,
    weights: dict[str, float],
    modulation: dict[Any, Any] | None = None,
    **attrs: Any,
) -> xr.DataArray:
    """Return mixed radiance: the sum over groups of weight times radiance.

    The sum is computed in float64 and rounded once, so that mixing is linear to half a unit of
    float32. A group of weight 0 is never read. At most `BLOCK_BANDS` bands of one group are in
    memory in addition to the result.

    Parameters
    ----------
    ds : scene radiance Dataset, W m-2 sr-1 nm-1; may be lazy.
    weights : {group: weight} for every group of the scene, each finite and >= 0.
    modulation : {group: Modulation} of the groups that vary in time; weights are those of the mean
        over time.
    **attrs : further attributes of the result.

    Returns
    -------
    (wavelength, y, x) float32 DataArray, W m-2 sr-1 nm-1. Where a group that has light varies:
    (component, wavelength, y, x), one component for all constant groups, if there are any, then one
    for each modulation, in the order of the scene's groups.

    Raises
    ------
    UnitError : light that was read is negative or not finite, or the sum is beyond float32.
    ConfigError : a modulation names a group the scene does not have.
    """
    for group, weight in weights.items():
        if weight == 0:
            ledger.left_out(f"group {group}", "weight 0", 0.0, "cd/m2", needless=True)
    label = "sums in float64, rounded once to float32"
    ledger.error(2.0**-24, "relative", "bound", label, key="rounding")
    parts = _parts(weights, modulation or {})
    width, height = field_size(ds)
    attrs = {
        "weights": dict(weights),
        "field_width": width,
        "field_height": height,
        **{k: ds.attrs[k] for k in ("pitch_x", "pitch_y", "projection") if k in ds.attrs},
        **attrs,
    }
    if list(parts) != [Modulation()]:
        attrs["modulation"] = {
            g: m._asdict() for m, groups in parts.items() for g in groups if not constant(m)
        }
    planes = (
        quantities.plane(
            _sum(ds, groups),
            ds.wavelength.values,
            ds.x.values,
            ds.y.values,
            quantities.RADIANCE,
            **attrs,
        )
        for groups in parts.values()
    )
    if list(parts) == [Modulation()]:
        return next(planes)
    return stacked(
        ("constant" if constant(m) else " + ".join(groups) for m, groups in parts.items()),
        list(parts),
        planes,
    )


def _parts(
    weights: dict[str, float], modulation: dict[Any, Any]
) -> dict[Modulation, dict[str, float]]:
    """Return {modulation: {group: weight}} of the groups with light; constant groups come first."""
    check_groups(modulation, list(weights))
    how = {g: modulation.get(g, Modulation()) for g, w in weights.items() if w != 0}
    how = {g: Modulation() if constant(m) else m for g, m in how.items()}
    order = sorted(dict.fromkeys(how.values()), key=lambda m: not constant(m)) or [Modulation()]
    return {m: {g: weights[g] for g, of in how.items() if of == m} for m in order}


def _sum(ds: xr.Dataset, weights: dict[str, float]) -> np.ndarray:
    """Return the (wavelength, y, x) float32 sum over `weights` of weight times radiance."""
    cube = ds["radiance"]
    summed = np.empty(cube.shape[1:], np.float32)
    for bands in _blocks(cube.sizes["wavelength"]):
        total = np.zeros(summed[bands].shape, np.float64)
        for group, weight in weights.items():
            total += weight * _read(ds, group, bands)
        if total.max(initial=0.0) > np.finfo(np.float32).max:
            raise UnitError(
                f"mixed radiance reaches {total.max():g} W m-2 sr-1 nm-1, beyond float32; expected"
                " at most 3.4e38; type smaller weights than"
                f" {', '.join(f'{group} {weight:.3g}' for group, weight in weights.items())}"
            )
        summed[bands] = total
    return summed


def luminance_map(ds: xr.Dataset, group: str) -> np.ndarray:
    """Return the luminance of one group at weight 1 within the camera's field, (y, x) float64,
    cd/m2.

    Tiles beyond the field are left out, because targets refer to the camera's picture.
    """
    weights = photometry.xyz_weights(ds.wavelength.values)[1]
    width, height = field_size(ds)
    # 1e-9: a tile centre never lies on the border, but coordinates stored in float32 move a little
    rows = np.abs(ds.y.values) < height / 2 * (1 + 1e-9)
    columns = np.abs(ds.x.values) < width / 2 * (1 + 1e-9)
    luminance = np.zeros((rows.sum(), columns.sum()))
    for bands in _blocks(ds.sizes["wavelength"]):
        luminance += np.tensordot(
            weights[bands], _read(ds, group, bands)[:, rows][:, :, columns], axes=1
        )
    return luminance


def field_size(ds: xr.Dataset) -> tuple[float, float]:
    """Return the camera's full field (width, height) in tangents; all tiles where the scene states
    none.
    """
    if "field_width" in ds.attrs and "field_height" in ds.attrs:
        return float(ds.attrs["field_width"]), float(ds.attrs["field_height"])
    return quantities.full_field(ds)


def _blocks(count: int) -> Any:
    return [slice(i, min(i + BLOCK_BANDS, count)) for i in range(0, count, BLOCK_BANDS)]


def _read(ds: xr.Dataset, group: str, bands: slice) -> np.ndarray:
    """Return one block of one group in float64, checked to be finite and not negative."""
    position = [str(g) for g in ds.light_group.values].index(group)
    block = ds["radiance"].isel(light_group=position, wavelength=bands).values.astype(np.float64)
    # NaN makes both NaN, and every comparison below false
    low = block.min()
    high = block.max()
    if not (low >= 0 and high < np.inf):
        nm = ds.wavelength.values[bands]
        raise UnitError(
            f"light group {group!r} holds values from {low:g} to {high:g} at {nm[0]:g}-{nm[-1]:g}"
            " nm; expected finite light, never negative; render or fetch the group again"
        )
    return block
