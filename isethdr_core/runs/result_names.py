"""Result names: names of the intermediate results of a run, derived from their inputs.

A name is the hash of the components with their fields, code, libraries and input files, of the part
of the core that runs the chain, and of the names of the input results. It contains no name that a
user chose for a camera, flare or metric, and nothing without influence on the result: light does
not depend on how it is developed, and captures do not depend on other cameras.

If the source of a component cannot be read, its results have no name that holds in another process
(None). The same is true for all results computed from them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..pipeline import bands
from ..pipeline.demand import Demand, Response
from ..storage.store import content_hash
from .provenance import CORE, described, fingerprint, have_source, input_digests, libraries

STEP_NM = 1.0  # step of the wavelengths at which a sensor's response enters the name of its light


def named(result: str, *made_of: Any) -> str | None:
    """Return the name of a result; None if one of its inputs has no name.

    Parameters
    ----------
    result : kind of the result.
    made_of : names and plain data from which the result follows.
    """
    if any(part is None for part in made_of):
        return None
    frame = fingerprint(frame=True)[CORE], libraries(frame=True)
    try:
        return content_hash({"result": result, "frame": frame, "of": made_of})
    except TypeError:  # a field of a plugin's component that is no plain value
        return None


def record(component: object) -> dict[str, Any] | None:
    """Return everything except its input on which a component's results depend; None if it cannot
    be identified.
    """
    if not have_source(component):
        return None
    made_by = {"code": fingerprint(component), "libraries": libraries(component)}
    return described(component) | made_by | {"inputs": input_digests(component)}


def of_radiance(scene: object, store_ids: list[str], demand: Demand) -> str | None:
    """Return the name of the scene radiance that a run reads.

    Parameters
    ----------
    scene : the scene component.
    store_ids : names of the stores that hold the radiance; empty for radiance that the scene itself
        makes.
    demand : demand of the run for scene radiance.
    """
    demanded = [demand.groups, demand.wavelength_nm, demand.labels, demand.margin]
    return named("radiance", store_ids or record(scene), demanded)


def of_mixed(radiance: str | None, lighting: object) -> str | None:
    """Return the name of mixed radiance."""
    return named("mixed", radiance, record(lighting))


def of_motion(mixed: str | None, record_of_motion: dict[str, Any]) -> str | None:
    """Return the name of the mixed radiance of a shot during which the scene moves.

    Parameters
    ----------
    mixed : name of the mixed radiance at the start of the shot.
    record_of_motion : moments, and the stores of their radiance.
    """
    return named("motion", mixed, record_of_motion)


def of_light(name: str | None, chain: Any, demand: Demand, mixed: Any) -> str | None:
    """Return the name of the light on the sensor plane.

    Parameters
    ----------
    name : name of the mixed radiance.
    chain : components of the run. Of its sensors, only code and demands enter the name.
    demand : demand of the run for light.
    mixed : mixed radiance, for its bands.
    """
    if name is None:
        return None
    sensors = chain.cameras.values()
    wavelength_nm = mixed.wavelength.values
    flares = _all(map(record, chain.flares.values()))
    demanded = [
        chain.leave_out,
        demand.error_allowed,
        demand.window_m,
        _answer(demand.response, wavelength_nm),
        bands.sensed_nm(sensors, wavelength_nm),
        sorted({digest for sensor in sensors for digest in fingerprint(sensor).values()}),
    ]
    return named("light", name, record(chain.lens), flares, demanded)


def _all(records: Iterable[Any]) -> list[Any] | None:
    names = list(records)
    return None if any(name is None for name in names) else names


def _answer(response: Response | None, wavelength_nm: np.ndarray) -> list[Any]:
    """Return the response of sensors as plain data; empty if they need irradiance."""
    if response is None:
        return []
    every_nm = np.arange(wavelength_nm[0], wavelength_nm[-1], STEP_NM)
    return [
        response.channels,
        [response.efficiency(nm) for nm in (wavelength_nm, every_nm) if len(nm)],
        response.area_exposure_m2_s,
        response.read_noise_e,
        response.full_scale_e,
        response.noise_fraction_allowed,
        response.window_m,
        response.pixel_m,
    ]
