"""The chain after the renderer, planned or set by hand, and its truth: electrons of every pixel."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from isethdr_optics.imaging.field_optics import field_optics as optics
from isethdr_optics.plan.planning import whole
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

FINER = 9.0  # times less than a lens allows kernels by itself: the truth's, on other points
WARM = 1  # runs with kernels at hand


@dataclass(frozen=True)
class Setting:
    """Choices that a person could make: mantissa bits kept, error of kernels, the way through the
    lens.
    """

    bits: int
    kernel_error: float
    way: str  # photocurrent or irradiance

    def __str__(self):
        return f"{self.bits} bits, kernels {self.kernel_error:g}, {self.way}"


@dataclass(frozen=True)
class Done:
    """Mean electrons of every capture, CPU seconds, and what the ledger says of the electrons'
    error.
    """

    electrons: list
    warm_s: float  # with kernels at hand
    making_s: float  # more, the first time
    bits: int | None
    stated: float = float("nan")


def parts_of(camera: str, lens) -> Chain:
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


def planned(parts: Chain, scene, fraction: float, folder, truth: list) -> Done:
    """Return what a run makes of stored radiance when so large a fraction of the noise is
    allowed.
    """
    (sensor,) = parts.cameras.values()
    demand = budget.budgeted(
        narrowed(sensor, Demand(wavelength_nm=tuple(scene.wavelength.values.tolist()))),
        budget.Allowed(fraction),
    )
    bits = bits_for(budget.stored_error(demand))
    done = _measured(
        parts, scene, lambda mixed: on_sensor(parts, mixed, demand), bits, folder, truth
    )
    rows, mixed = Ledger(), parts.lighting(scene)
    made = imaging(parts, mixed, demand)
    with ledger.stage(rows, "lens"):
        light = made.light()
    rows.append(Row("radiance", errors=[radiance_cache.rounding_term(rounding(bits))]))
    return replace(done, stated=_stated(made.plan, rows, mixed, light, scene, truth, fraction))


def by_hand(parts: Chain, scene, setting: Setting, folder, truth: list) -> Done:
    """Return what settings by hand make of it: nobody looks at the light to choose more."""
    (sensor,) = parts.cameras.values()
    lens, flares, response = (
        replace(parts.lens, speckle_error=setting.kernel_error),
        tuple(parts.flares.values()),
        narrowed(sensor, Demand()).response,
    )

    def way(mixed):
        return (
            whole(lens, flares, mixed, response).image(mixed)
            if setting.way == "photocurrent"
            else lens(mixed, flares, response.error_allowed)
        )

    return _measured(parts, scene, way, setting.bits, folder, truth)


def _measured(parts, scene, way, bits, folder, truth) -> Done:
    taken = []
    for again in range(1 + WARM):
        start = time.process_time()
        back = store.open_store(
            store.write_store(
                folder, f"b{time.monotonic_ns()}-{again}", {"": scene}, {}, keepbits=bits
            )
        ).load()
        mixed = parts.lighting(back)
        light = way(mixed)
        rates = _electrons(light, mixed, back, truth)
        taken.append(time.process_time() - start)
    return Done(rates, min(taken[1:]), max(taken[0] - min(taken[1:]), 0.0), bits)


def _stated(plan, rows, mixed, light, scene, truth, fraction) -> float:
    """Return what the last line of a run's ledger says of everything after the renderer, the worst
    capture's.
    """
    exposure = propagation.Exposure(truth[0], light, mixed, scene)
    shots = propagation.electrons(exposure, 0.0, plan.light_errors)
    shots = propagation.with_parts(shots, truth[0], rows)
    with ledger.stage(Ledger(), "picture") as row:
        propagation.record_figures(shots, rows, fraction, propagation.Seconds(0.0, 0.0))
    return max(e.value for e in row.errors if e.source.key == propagation.AFTER_RENDERER)


def _electrons(light, mixed, scene, truth):
    exposure = propagation.Exposure(truth[0], light, mixed, scene)
    return [shot.total for shot in propagation.electrons(exposure)]


def exact(parts: Chain, scene) -> list:
    """Return (captures, electrons, noise, unsaturated, own error) of a scene: every band in
    float64, nothing left out, finer kernels.

    The convolution is SciPy's; kernels have their points elsewhere than those of any chain under
    test. Its own error is the standard deviation of 99 % of the pixels that its kernels leave, in
    units of the noise.
    """
    lens = replace(parts.lens, speckle_error=parts.lens.speckle_error / FINER)
    flares, mixed = tuple(parts.flares.values()), parts.lighting(scene)
    given, light = optics(lens, mixed, flares), lens(mixed, flares=flares)
    factor = 1.0 if given.relative is None else given.relative
    cube = np.stack(
        [
            gain
            * fftconvolve(band * factor, np.asarray(kernel, float))[
                tuple(slice(k // 2, k // 2 + n) for k, n in zip(kernel.shape, band.shape))
            ]
            for gain, band, kernel in zip(given.gains, mixed.values.astype(float), given.made.bands)
        ]
    )
    light = quantities.plane(
        np.maximum(cube, 0.0),
        light.wavelength.values,
        light.x.values,
        light.y.values,
        **light.attrs,
    )
    (sensor,) = parts.cameras.values()
    captures = sensor(light, generator(seed=0))
    shots = propagation.electrons(
        propagation.Exposure(captures, light, mixed, scene),
        0.0,
        lambda mean, weights: lens.spread_errors(mean, flares, weights),
    )
    own = max(
        float(np.quantile((s.maps.deviation / s.sigma)[s.unsaturated], propagation.SHARE))
        for s in shots
        if s.unsaturated.any()
    )
    return [
        captures,
        [s.total for s in shots],
        [s.sigma for s in shots],
        [s.unsaturated for s in shots],
        own,
    ]


def errors(done: Done, truth: list) -> np.ndarray:
    """Return the errors of all unsaturated pixels of all captures, in standard deviations of the
    noise.
    """
    _, electrons, sigma, unsaturated, _ = truth
    return np.concatenate(
        [
            (np.abs(a - b) / s)[u]
            for a, b, s, u in zip(done.electrons, electrons, sigma, unsaturated)
        ]
    )
