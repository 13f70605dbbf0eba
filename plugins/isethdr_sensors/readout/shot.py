"""One shot, in physical order: light, crosstalk, shot noise, full well, readings, converter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core import ledger, quantities
from isethdr_core.data.derived_once import once
from isethdr_core.data.temporal_modulation import components
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.noise import LARGEST_MEAN_E, rows_per_block
from isethdr_core.runs.seeds import Generator
from isethdr_core.uncertainty.error_terms import Quantity

from ..charge import blooming, crosstalk, full_well
from ..noise import fixed_pattern, read_noise, row_noise, shot_noise, telegraph_noise
from ..noise.dark_current import dark_electrons
from ..noise.fixed_pattern import OffsetSpread
from ..sampling import area_integration, microlens
from ..sampling.pixel_grid import check_tiles, pixel_grid
from ..sensor_model import Photodiode, SensorModel
from ..spectral import response
from ..spectral.colour_filter_array import filter_map
from ..spectral.quantum_efficiency import line_error, quantum_efficiency, smooth_spectrum_error
from ..timing import exposure_timing
from . import captures, chip_combination, converter, interleave, optical_black

if TYPE_CHECKING:
    import xarray as xr

    from ..sampling.pixel_grid import PixelGrid
    from ..sensor_model import Reading


def take_shot(model: SensorModel, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
    """Return the captures of one shot.

    Parameters
    ----------
    model : photodiodes and readings of the sensor.
    light : irradiance DataArray ([component,] wavelength, y, x), W m-2 nm-1, or photocurrent.
    generator : `isethdr_core.seeds.Generator`. The random numbers of the shot depend on its seed
        and scene, those of the fixed pattern on its device. May be None for a model without noise.
    """
    check_generator(model, generator)
    # the same for every realisation of the noise
    key = "light electrons", model
    grid, filters, qe, light_e = once(key, (light,), lambda: light_electrons(model, light))
    state_errors(model, light)
    raw, saturated = readings(
        model, optical_black.with_black_rows(light_e, model.black_rows), generator
    )
    captured_model = model
    if model.combine_bits:
        raw, saturated = chip_combination.combine(model, raw, saturated)
        captured_model = chip_combination.combined_model(model)
    raw, black = optical_black.parted(raw, model.black_rows)
    saturated, _ = optical_black.parted(saturated, model.black_rows)
    out = captures.captures(
        captured_model, light, grid, captures.Mosaic(raw, saturated, filters, qe)
    )
    if model.black_rows:
        out = optical_black.with_optical_black(out, black)
    if model.noise and np.isfinite(model.defect_e_per_s):
        out[DEFECT] = ("y", "x"), defects(model, generator, *raw.shape[1:])
    if not model.combine_bits:
        return out
    # the steps visible in the codes are those of the finest converter
    finest = model.readings[chip_combination.sources(model)[-1].number]
    out["quantisation_e"][:] = converter.quantisation_e(finest)
    return captures.with_response(out, chip_combination.response(model))


def check_generator(model: SensorModel, generator: Generator | None) -> None:
    """Raise ConfigError if a sensor with noise has no generator of isethdr."""
    if model.noise and not isinstance(generator, Generator):
        given = "no generator" if generator is None else f"{type(generator).__name__} as generator"
        raise ConfigError(
            f"a sensor with noise got {given}; expected hdr.generator(...), "
            "for example sensor(light, hdr.generator(seed=7)), or build it with noise=False"
        )


DEFECT = "defect"  # variable of the captures: the device's map of defects
PLACE_IN_BAND = "place in band"  # ledger key of the unknown position of light within its bands


def expected_electrons(model: SensorModel, light: xr.DataArray) -> xr.DataArray:
    """Return the mean electrons of light and dark charge, DataArray (capture, y, x), without noise,
    full well or converter.

    The result is affine in the light. Without light it is `dark_e` of the captures.
    """
    grid, _, _, light_e = light_electrons(model, light)
    if model.combine_bits:
        best = chip_combination.sources(model)[-1].diode
        mean_e = light_e[best] + dark_charge_e(model, model.photodiodes[best])
        return captures.electrons(chip_combination.combined_model(model), grid, mean_e[None])
    mean_e = [
        light_e[reading.diode] + dark_charge_e(model, model.diode_of(reading))
        for reading in model.readings
    ]
    return captures.electrons(model, grid, np.stack(mean_e))


def state_errors(model: SensorModel, light: xr.DataArray) -> None:
    """State in the ledger the errors of every shot of `model`: the unknown position of light within
    bands, the model of the microlenses, and the nonlinearity and the lower end of the converter.
    """
    wavelength_nm = quantities.bands_nm(light)
    if len(wavelength_nm) > 1:
        value = smooth_spectrum_error(model, wavelength_nm, _mean_spectrum(light))
        label = (
            "light assumed uniform over each band: largest error for black bodies of 2000 to"
            " 20000 K and for the mean spectrum of the light"
        )
        ledger.error(
            value, "relative", "measured", label, key="spectral bands", acts_on=Quantity.ELECTRONS
        )
        ledger.left_out(
            "position of spectral lines within a band",
            "the light consists of band means, which are taken as uniform over each band",
            line_error(model, wavelength_nm),
            "of the electrons that the same energy makes in the filters' strongest band",
            key=PLACE_IN_BAND,
        )
    if model.microlenses:
        grid = pixel_grid(light, model.pitch_um, model.rows, model.columns)
        microlens.state(model.microlenses, light, grid)
    for reading in model.readings:
        converter.state_nonlinearity(reading)
        if model.noise:
            converter.check_black_level(reading)


def _mean_spectrum(light: xr.DataArray) -> np.ndarray | None:
    """Return the mean irradiance (band,) of light; None for photocurrent, which has no spectrum."""
    if "wavelength" not in light.dims:
        return None
    if light.dims[0] == "wavelength":  # NumPy sums pairwise, so the dtype of light is enough
        return light.values.reshape(light.sizes["wavelength"], -1).mean(axis=1).astype(float)
    return light.values.mean(
        axis=tuple(k for k, d in enumerate(light.dims) if d != "wavelength"), dtype=float
    )


def light_electrons(
    model: SensorModel, light: xr.DataArray
) -> tuple[PixelGrid, np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return the pixel grid, the filters (y, x), the quantum efficiency (channel, wavelength) with
    crosstalk between filters, and for each photodiode the mean light electrons (y, x) of the
    exposure.
    """
    grid, filters, qe, parts = component_electrons(model, light)
    light_e = exposure_timing.together(model, parts, filters)
    return grid, filters, qe, light_e


def component_electrons(
    model: SensorModel, light: xr.DataArray
) -> tuple[PixelGrid, np.ndarray, np.ndarray, list[tuple[Any, ...]]]:
    """Return the same as `light_electrons`, but with the electrons of each component of light apart
    as the last item: [(Modulation, list over photodiodes of (y, x) electrons at the mean light over
    time), ...].
    """
    planes = components(light)
    for _, plane in planes:
        response.check_light(plane)
    grid = pixel_grid(light, model.pitch_um, model.rows, model.columns)
    check_tiles(light, grid)
    filters = filter_map(model.cfa, len(grid.y_m), len(grid.x_m))
    wavelength_nm = quantities.bands_nm(light)
    qe = quantum_efficiency(model, wavelength_nm)
    return (
        grid,
        filters,
        crosstalk.mixed_efficiency(qe, model, wavelength_nm),
        [(m, _mean_electrons(model, plane, grid, filters, qe)) for m, plane in planes],
    )


def _mean_electrons(
    model: SensorModel, light: xr.DataArray, grid: PixelGrid, filters: np.ndarray, qe: np.ndarray
) -> list[np.ndarray]:
    """Return for each photodiode the mean electrons (y, x) of the exposure to constant light."""
    x = light.x.values
    y = light.y.values
    planes = response.channel_planes(model, light, qe)
    accepted = model.microlenses and microlens.accepted(model.microlenses, light, grid)

    def collected(plane: np.ndarray, fill_factor: float) -> np.ndarray:
        electrons = area_integration.electrons_per_s(plane, x, y, grid, filters, fill_factor)
        return electrons if accepted is None else electrons * accepted

    per_fill = {
        fill: model.exposure_s * crosstalk.spread([collected(p, fill) for p in planes], model)
        for fill in {diode.fill_factor for diode in model.photodiodes}
    }
    return [
        (
            per_fill[diode.fill_factor]
            if diode.exposure_share == 1
            else per_fill[diode.fill_factor] * diode.exposure_share
        )
        for diode in model.photodiodes
    ]


def readings(
    model: SensorModel,
    light_e: Sequence[np.ndarray],
    generator: Generator | None,
    block_rows: int | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return `raw` DN and `saturated`, both (capture, y, x), from the mean light electrons of each
    photodiode.

    Parameters
    ----------
    model : `SensorModel` of the sensor.
    light_e : for each photodiode the (y, x) mean electrons of light of the whole exposure.
    generator : key of the noise of the shot and of the device; None for a model without noise.
    block_rows : rows computed at a time; the result is the same for any number.

    Notes
    -----
    `saturated` is true where the charge fills the well or the converter gives its top code. A full
    well cannot be recognised in `raw`: read noise may take it below the top code, although that
    value measures no light.
    """
    height, width = light_e[0].shape
    raw = np.empty((len(model.readings), height, width), converter.raw_dtype(model.readings))
    saturated = np.empty(raw.shape, bool)
    device = generator.device if generator is not None else None
    prnu, dark, offsets, widths = once(
        ("device maps", model, device, height, width),
        (),
        lambda: device_maps(model, generator, height, width),
    )
    step = block_rows or rows_per_block(width)
    blocks = [slice(y, min(y + step, height)) for y in range(0, height, step)]

    def charge(k: int, rows: slice) -> np.ndarray:
        mean_e = light_e[k][rows] * part(prnu[k], rows) + part(dark[k], rows)
        return _charge(model, model.photodiodes[k], mean_e, generator, rows.start)

    # blooming runs along columns and therefore across blocks, so that it needs the whole charge
    bloomed = {
        k: blooming.bloom(
            np.concatenate([charge(k, rows) for rows in blocks]),
            diode.full_well_e,
            diode.blooming_percent,
        )
        for k, diode in enumerate(model.photodiodes)
        if diode.blooming_percent
    }
    for rows in blocks:
        charges = [
            bloomed[k][rows] if k in bloomed else charge(k, rows)
            for k in range(len(model.photodiodes))
        ]
        for k, reading in enumerate(model.readings):
            electrons = charges[reading.diode]
            full = full_well.full(electrons, model.diode_of(reading).full_well_e)
            noise = ReadingNoise(part(offsets[k], rows), part(widths[k], rows))
            dn = read_dn(model, reading, electrons, noise, generator, rows.start)
            saturated[k, rows] = full | (dn >= converter.top_code(reading))
            raw[k, rows] = converter.companded(dn, reading)
    return raw, saturated


def dark_charge_e(model: SensorModel, diode: Photodiode) -> float:
    """Return the mean dark charge of the exposure in `diode`, electrons."""
    return dark_electrons(diode.dark_e_per_s, model.exposure_of(diode), model.temperature_c)


def _charge(
    model: SensorModel,
    diode: Photodiode,
    mean_e: np.ndarray,
    generator: Generator | None,
    first_row: int,
) -> np.ndarray:
    if model.noise:
        mean_e = (
            np.minimum(mean_e, LARGEST_MEAN_E)
            if diode.blooming_percent
            else full_well.limit_mean(mean_e, diode.full_well_e)
        )
        mean_e = shot_noise.collect(mean_e, generator.stream(diode.name, "shot"), first_row)
    return mean_e if diode.blooming_percent else full_well.limit_charge(mean_e, diode.full_well_e)


class ReadingNoise(NamedTuple):
    """Offsets and read noise of one reading of a device, electrons: numbers or maps (y, x)."""

    offset_e: Any
    width_e: Any  # rms of the read noise


def read_dn(
    model: SensorModel,
    reading: Reading,
    electrons: np.ndarray,
    noise: ReadingNoise,
    generator: Generator | None,
    first_row: int,
) -> np.ndarray:
    """Return the linear DN (y, x) of one reading of a block of rows.

    Parameters
    ----------
    model : the sensor's model.
    reading : converter and noise of the reading.
    electrons : (y, x) charge, electrons.
    noise : offset and read noise of the same pixels.
    generator : key of the noise of the reading; not used by a model without noise.
    first_row : the block's first row, counted from the sensor's upper left pixel.
    """
    if model.noise or np.ndim(noise.offset_e):
        electrons = electrons + noise.offset_e
    if model.noise and (np.ndim(noise.width_e) or noise.width_e):
        electrons = electrons + read_noise.read_noise(
            noise.width_e, generator.stream(reading.capture, "read"), first_row, *electrons.shape
        )
    if model.noise and reading.telegraph_percent and reading.telegraph_e:
        steps = telegraph_noise.steps_e(
            reading.telegraph_e,
            reading.telegraph_percent,
            generator.device_stream(reading.capture, "traps"),
            range(first_row, first_row + len(electrons)),
            electrons.shape[1],
        )
        electrons = electrons + telegraph_noise.telegraph_noise(
            steps, generator.stream(reading.capture, "telegraph"), first_row
        )
    if model.noise and reading.row_noise_e:
        electrons = electrons + row_noise.row_noise(
            reading.row_noise_e, generator.stream(reading.capture, "row"), first_row, len(electrons)
        )
    return converter.digitise(electrons, reading)


def device_maps(
    model: SensorModel, generator: Generator | None, height: int, width: int
) -> tuple[
    list[float | np.ndarray],
    list[float | np.ndarray],
    list[float | np.ndarray],
    list[float | np.ndarray],
]:
    """Return the PRNU factor and the dark electrons of each photodiode, and the offset and the read
    noise (rms) of each reading, electrons. Each is a map (y, x), a row (1, x) or a number.

    Parameters
    ----------
    model : `SensorModel` of the sensor.
    generator : the maps depend on its device; None for a model without noise.
    height, width : size of the sensor, pixels; rows behind metal included.
    """
    size = height, width
    dark = [dark_charge_e(model, diode) for diode in model.photodiodes]
    less = interleave.dark_map(model, *size)
    clamp = [dark[reading.diode] * (1 - less) for reading in model.readings]
    if not model.noise:
        return [1.0] * len(dark), [mean * less for mean in dark], clamp, [0.0] * len(clamp)
    key = generator.device_stream
    silicon = [diode.silicon or diode.name for diode in model.photodiodes]
    prnu = [
        fixed_pattern.factor(d.prnu, key(name, "prnu"), *size)
        for d, name in zip(model.photodiodes, silicon, strict=True)
    ]
    dark = [
        mean * fixed_pattern.factor(d.dark_spread, key(name, "dark"), *size) * less if mean else 0.0
        for mean, d, name in zip(dark, model.photodiodes, silicon, strict=True)
    ]
    for k, d in enumerate(model.photodiodes):
        if d.hot_percent and d.hot_dark_e_per_s:
            extra = dark_electrons(d.hot_dark_e_per_s, model.exposure_of(d), model.temperature_c)
            dark[k] = dark[k] + extra * less * fixed_pattern.hot_dark(
                d.hot_percent / 100, key(silicon[k], "hot"), *size
            )
    offsets = [
        level
        + fixed_pattern.offset_e(
            OffsetSpread(r.dsnu_e, key(r.capture, "dsnu")),
            OffsetSpread(r.column_e, key(r.capture, "column")),
            OffsetSpread(r.row_e, key(r.capture, "rows")),
            *size,
        )
        for level, r in zip(clamp, model.readings, strict=True)
    ]
    widths = [
        (
            read_noise.widths_e(r.read_noise_e, r.read_tail_percent, key(r.capture, "tail"), *size)
            if r.read_tail_percent
            else r.read_noise_e
        )
        for r in model.readings
    ]
    return prnu, dark, offsets, widths


def defects(model: SensorModel, generator: Generator, height: int, width: int) -> np.ndarray:
    """Return the device's map of defects, (y, x) bool: pixels with a photodiode that has
    `defect_e_per_s` or more of extra dark current.

    Parameters
    ----------
    model : `SensorModel`; its `defect_e_per_s` is the limit at 60 C.
    generator : the map depends on its device.
    height, width : size of the sensor, pixels.
    """
    defective = np.zeros((height, width), bool)
    for diode in model.photodiodes:
        if diode.hot_percent and diode.hot_dark_e_per_s:
            stream = generator.device_stream(diode.silicon or diode.name, "hot")
            hot = fixed_pattern.hot_dark(diode.hot_percent / 100, stream, height, width)
            defective |= (hot > 0) & (hot * diode.hot_dark_e_per_s >= model.defect_e_per_s)
    return defective


def part(values: float | np.ndarray, rows: slice) -> float | np.ndarray:
    """Return the rows of a map; a number or a map of one row is returned unchanged."""
    return values[rows] if np.ndim(values) and values.shape[0] > 1 else values
