"""Frame exposures: the cameras of a frame at carried exposures, and what each of them meters."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial
from math import log2
from typing import TYPE_CHECKING, Any, NamedTuple

from ..plugins.protocols import CarriesExposure
from ..uncertainty import ledger
from ..uncertainty.error_terms import Quantity
from ..uncertainty.ledger import Ledger
from .exposure import Exposure, ExposureLimits, SettledExposure

if TYPE_CHECKING:
    from ..pipeline.chain import Chain


class FrameExposures(NamedTuple):
    """The chain of a frame, and the record of its exposures."""

    chain: Chain  # with cameras at the carried exposures
    record: dict[str, Any]  # by camera: exposure, settled exposure and limits, as plain data


def at_carried_exposures(chain: Chain, rows: Ledger, light: Any) -> FrameExposures:
    """Return the chain of a frame of a sequence, after its light is known.

    A camera without a carried exposure uses the exposure to which it would settle for this frame.
    The ledger states how far each carried exposure is from this settled exposure.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger of the run.
    light : light on the sensor plane.
    """
    if chain.exposures is None:
        return FrameExposures(chain, {})
    cameras = dict(chain.cameras)
    record: dict[str, Any] = {}
    with ledger.stage(rows, "exposure"):
        for name, sensor in chain.cameras.items():
            if not (isinstance(sensor, CarriesExposure) and sensor.longest_exposure_s):
                continue
            settled = ledger.collected(partial(sensor.settled_exposure, light)).result
            exposure = chain.exposures.get(name, settled.exposure)
            if name in chain.exposures:
                cameras[name] = sensor.at_exposure(exposure)
            stops = log2(exposure.product_s / settled.exposure.product_s)
            ledger.error(
                abs(2.0**stops - 1),
                "relative",
                "measured",
                f"exposure of {name} against its settled exposure, {stops:+.3g} stops",
                key=name,
                acts_on=Quantity.TARGET,
            )
            record[name] = {"exposure": asdict(exposure), **asdict_settled(settled)}
    return FrameExposures(replace(chain, cameras=cameras), record)


def asdict_settled(settled: SettledExposure) -> dict[str, Any]:
    """Return a settled exposure as plain data."""
    return {"settled": asdict(settled.exposure), "limits": asdict(settled.limits)}


def settled_of(record: dict[str, Any]) -> SettledExposure:
    """Return the settled exposure that the record of a camera states."""
    stored = record["settled"]
    exposure = Exposure(**stored | {"ratios": tuple(stored["ratios"])})
    return SettledExposure(exposure, ExposureLimits(**record["limits"]))
