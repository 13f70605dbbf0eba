"""The slow way, for machines without LLVM: Mitsuba's own path integrator, group by group, four bands a pass.

A film with exactly four bands of equal width gets exactly one wavelength per band and path, so that no noise
comes from the choice of wavelength.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from isethdr_core.errors import ConfigError

from .beam_lamp import beam_lamp, film, sensor
from .geometry import build_world
from .materials import coloured_surfaces, regular

BLOCK = 4


def film_pass(description, view, lamps, groups, bands_nm, settings):
    """Return the function of one pass, as `radiance.estimate` wants it. Other groups' lamps are black, not absent."""
    if abs(view.pitch_x / view.pitch_y - 1) > 1e-3:
        raise ConfigError(f"variant scalar needs square tiles; width {settings.width} x height {settings.height} on a field of "
                          f"aspect {view.field[0] / view.field[1]:.4g} are not; type renderer.height={round(settings.width * view.field[1] / view.field[0])}")
    rows, columns = view.shape
    span = bands_nm[0] - settings.step_nm / 2, bands_nm[-1] + settings.step_nm / 2
    # a short last block is filled up with the bands before it, so that every film has four bands of equal area
    starts = sorted({min(s, max(len(bands_nm) - BLOCK, 0)) for s in range(0, len(bands_nm), BLOCK)})
    integrator = mi.load_dict({"type": "path", "max_depth": settings.max_depth, "rr_depth": 1000})
    sensors = [mi.load_dict(sensor(view, film(_block(bands_nm, s, settings.step_nm), settings.step_nm, columns, rows))) for s in starts]
    worlds = [_world_of(g, description, view, lamps, span) for g in groups]

    def one_pass(seed, samples):
        for g, world in enumerate(worlds):
            done = 0
            for start, one_sensor in zip(starts, sensors, strict=True):
                image = np.array(mi.render(world.scene, sensor=one_sensor, integrator=integrator, spp=samples,
                                           seed=(seed * 1000 + 10 * start + g) & 0xFFFFFFFF))
                for k in range(start, min(start + BLOCK, len(bands_nm))):
                    if k >= done:
                        yield g, k, image[..., k - start].ravel() / settings.step_nm
                done = start + BLOCK

    return one_pass


def _block(bands_nm, start, step_nm):
    """Return four band centres from number `start` on, made up beyond the last band where there are fewer."""
    block = list(bands_nm[start:start + BLOCK])
    return block + [block[-1] + step_nm * (k + 1) for k in range(BLOCK - len(block))]


def _world_of(group, description, view, lamps, span):
    def emitter_of(index):
        return beam_lamp(lamps[index], view.origin_m) if lamps[index].lamp.group == group else None

    extra = {}
    if group == "sky" and description.sky is not None:
        extra["sky_light"] = {"type": "constant", "radiance": regular(description.sky, *span)}
    return build_world(description, coloured_surfaces(description, *span), emitter_of, **extra)
