"""The chain after the renderer, planned or set by hand, and its reference: electrons of every
pixel.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics.imaging.field_optics import field_optics as optics
from isethdr_optics.plan.planning import complete_plan
from scipy.signal import fftconvolve

from isethdr_core import ledger, quantities, store
from isethdr_core.demand import Demand
from isethdr_core.ledger import Ledger, Row
from isethdr_core.pipeline.chain import Chain, imaging, narrowed, on_sensor
from isethdr_core.plugins.registry import build
from isethdr_core.runs import radiance_cache
from isethdr_core.seeds import generator
from isethdr_core.storage.encoding import bits_for, rounding
from isethdr_core.uncertainty import budget, propagation

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Lens

# default kernel error of the lens over that of the reference; the sample points then differ, too
FINER = 9.0
WARM = 1  # number of runs with stored kernels


@dataclass(frozen=True)
class Setting:
    """Choices that a person could make: mantissa bits kept, error of kernels, and the quantity that
    the lens computes.
    """

    bits: int
    kernel_error: float
    way: str  # photocurrent or irradiance

    def __str__(self) -> str:
        return f"{self.bits} bits, kernels {self.kernel_error:g}, {self.way}"


@dataclass(frozen=True)
class Done:
    """Mean electrons of every capture, CPU seconds, and the error of the electrons that the ledger
    states.
    """

    electrons: list
    warm_s: float  # with stored kernels
    making_s: float  # additional seconds of the first run, which computes the kernels
    bits: int | None
    stated: float = float("nan")


def parts_of(camera: str, lens: Lens) -> Chain:
    """Return a chain of a camera, a lens and its dirt."""
    return Chain(
        None,
        None,
        build("lighting", "weights", weights={"ambient": 1.0, "lamps": 1.0}),
        {},
        lens,
        {"dirt": build("flare", "aperture")},
        {camera: build("sensor", camera)},
        None,
        {},
    )


def planned(chain: Chain, scene: xr.Dataset, fraction: float, folder: Path, truth: list) -> Done:
    """Return the result of a run on stored radiance that plans its own settings for an error
    allowed.

    Parameters
    ----------
    chain : components of the run.
    scene : scene radiance.
    fraction : error allowed, in standard deviations of the sensor's noise.
    folder : folder for the stored radiance.
    truth : the reference, as `exact` returns it.
    """
    (sensor,) = chain.cameras.values()
    demand = budget.budgeted(
        narrowed(sensor, Demand(wavelength_nm=tuple(scene.wavelength.values.tolist()))),
        budget.Allowed(fraction),
    )
    bits = bits_for(budget.stored_error(demand))
    result = _measured(
        chain, scene, lambda mixed: on_sensor(chain, mixed, demand), bits, folder, truth
    )
    rows = Ledger()
    mixed = chain.lighting(scene)
    imaged = imaging(chain, mixed, demand)
    with ledger.stage(rows, "lens"):
        light = imaged.light()
    rows.append(Row("radiance", errors=[radiance_cache.rounding_term(rounding(bits))]))
    exposure = propagation.Exposure(truth[0], light, mixed, scene)
    return replace(result, stated=_stated(imaged.plan, rows, exposure, fraction))


def by_hand(chain: Chain, scene: xr.Dataset, setting: Setting, folder: Path, truth: list) -> Done:
    """Return the result of a run with settings by hand, which do not depend on the light.

    Parameters
    ----------
    chain : components of the run.
    scene : scene radiance.
    setting : choices of the person.
    folder : folder for the stored radiance.
    truth : the reference, as `exact` returns it.
    """
    (sensor,) = chain.cameras.values()
    lens = replace(chain.lens, speckle_error=setting.kernel_error)
    flares = tuple(chain.flares.values())
    response = narrowed(sensor, Demand()).response

    def way(mixed: xr.DataArray) -> xr.DataArray | Any:
        return (
            complete_plan(lens, flares, mixed, response).image(mixed)
            if setting.way == "photocurrent"
            else lens(mixed, flares, response.error_allowed)
        )

    return _measured(chain, scene, way, setting.bits, folder, truth)


def _measured(
    chain: Chain, scene: xr.Dataset, image: np.ndarray, bits: int, folder: Path, truth: Any
) -> Done:
    cpu_s = []
    for attempt in range(1 + WARM):
        start = time.process_time()
        back = store.open_store(
            store.write_store(
                folder, f"b{time.monotonic_ns()}-{attempt}", {"": scene}, {}, keepbits=bits
            )
        ).load()
        mixed = chain.lighting(back)
        light = image(mixed)
        rates = _electrons(light, mixed, back, truth)
        cpu_s.append(time.process_time() - start)
    return Done(rates, min(cpu_s[1:]), max(cpu_s[0] - min(cpu_s[1:]), 0.0), bits)


def _stated(
    plan: Any, rows: Sequence[dict[str, Any]], exposure: propagation.Exposure, fraction: float
) -> float:
    """Return the error in the last row of a run's ledger. It covers everything after the renderer
    and is that of the worst capture.
    """
    shots = propagation.electrons(exposure, 0.0, plan.light_errors)
    shots = propagation.with_parts(shots, exposure.captures, rows)
    with ledger.stage(Ledger(), "picture") as row:
        propagation.record_figures(shots, rows, fraction, propagation.Seconds(0.0, 0.0))
    return max(e.value for e in row.errors if e.source.key == propagation.AFTER_RENDERER)


def _electrons(
    light: xr.DataArray, mixed: xr.DataArray, scene: xr.Dataset, truth: Any
) -> list[Any]:
    exposure = propagation.Exposure(truth[0], light, mixed, scene)
    return [shot.total for shot in propagation.electrons(exposure)]


def exact(chain: Chain, scene: xr.Dataset) -> list:
    """Return [captures, electrons, noise, unsaturated, own error] of a scene, as the reference:
    every band in float64, nothing left out, finer kernels.

    The convolution is SciPy's. The sample points of the kernels differ from those of all chains
    under test. The own error is the standard deviation that the kernels cause in electrons, in
    units of the noise; 99 % of the pixels have at most this one.

    Parameters
    ----------
    chain : components of the run.
    scene : scene radiance.
    """
    lens = replace(chain.lens, speckle_error=chain.lens.speckle_error / FINER)
    flares = tuple(chain.flares.values())
    mixed = chain.lighting(scene)
    field = optics(lens, mixed, flares)
    light = lens(mixed, flares=flares)
    factor = 1.0 if field.relative is None else field.relative
    cube = np.stack(
        [
            gain
            * fftconvolve(band * factor, np.asarray(kernel, float))[
                tuple(slice(k // 2, k // 2 + n) for k, n in zip(kernel.shape, band.shape))
            ]
            for gain, band, kernel in zip(
                field.gains, mixed.values.astype(float), field.kernels.bands
            )
        ]
    )
    light = quantities.plane(
        np.maximum(cube, 0.0),
        light.wavelength.values,
        light.x.values,
        light.y.values,
        **light.attrs,
    )
    (sensor,) = chain.cameras.values()
    captures = sensor(light, generator(seed=0))
    shots = propagation.electrons(
        propagation.Exposure(captures, light, mixed, scene),
        0.0,
        lambda mean, weights: lens.light_errors(mean, flares, weights),
    )
    own_error = max(
        float(np.quantile((s.maps.deviation / s.sigma)[s.unsaturated], propagation.SHARE))
        for s in shots
        if s.unsaturated.any()
    )
    return [
        captures,
        [s.total for s in shots],
        [s.sigma for s in shots],
        [s.unsaturated for s in shots],
        own_error,
    ]


def errors(result: Done, truth: list) -> np.ndarray:
    """Return the errors of all unsaturated pixels of all captures, in standard deviations of the
    noise.

    Parameters
    ----------
    result : result of a chain under test.
    truth : the reference, as `exact` returns it.
    """
    _, electrons, sigma, unsaturated, _ = truth
    return np.concatenate(
        [
            (np.abs(a - b) / s)[u]
            for a, b, s, u in zip(result.electrons, electrons, sigma, unsaturated)
        ]
    )
