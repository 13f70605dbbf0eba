"""Checks: combinations of components that cannot work together, refused before any work.

Each check uses the data that components state in advance. Components that state nothing are checked
when their results arrive.
"""

from __future__ import annotations

from dataclasses import replace

from ...errors import ConfigError
from ...motion.shot_time import shot_time
from ...plugins.protocols import CarriesExposure, MovesInTime
from .. import early_checks
from ..field_check import check_fields, check_rendered
from .components import Chain


def check_combination(chain: Chain, rendered: bool) -> None:
    """Raise ConfigError if components of a chain do not fit each other, and PluginError if scene or
    renderer state their field or tiles in another form.

    Parameters
    ----------
    chain : components of the run.
    rendered : whether the radiance of the scene is stored already. Its light groups are then
        checked when a lighting mixes them.
    """
    early_checks.check_statements(chain.scene, chain.renderer)
    check_fields(chain.scene, chain.lens, chain.cameras.values())
    check_rendered(chain.scene, chain.renderer)
    early_checks.check_shots(tuple(chain.cameras.values()), chain.isp)
    if not rendered:
        early_checks.check_scene(chain.scene, chain.lighting, tuple(chain.versions.values()))
    check_motion(chain)
    check_exposures(chain)


def check_motion(chain: Chain) -> None:
    """Raise ConfigError if motion during the shot is requested, and the duration of the shot is not
    known, the scene does not exist at its end, or it states no motion over so short or long a time.
    """
    if chain.motion is None or not isinstance(chain.scene, MovesInTime):
        return
    shot_s = shot_time(chain.scene, chain.lens, chain.cameras).seconds
    replace(chain.scene, time_s=chain.scene.time_s + shot_s)  # refused if it has ended by then
    try:
        replace(chain.scene, frames_per_s=1 / shot_s)  # as the motion during the shot is found
    except ConfigError:
        raise ConfigError(
            f"motion.within_exposure is set, but a shot takes {shot_s:.3g} s, and"
            f" {type(chain.scene).__name__} states no motion over this time; expected another"
            " exposure or line time; type motion.within_exposure=false"
        ) from None


def check_exposures(chain: Chain) -> None:
    """Raise ConfigError if an exposure is carried to a camera without automatic exposure, or to a
    camera that cannot use this exposure.
    """
    for name, exposure in (chain.exposures or {}).items():
        sensor = chain.cameras[name]
        if not (isinstance(sensor, CarriesExposure) and sensor.longest_exposure_s):
            raise ConfigError(
                f"exposures names the camera {name!r}, whose exposure is not automatic; expected a"
                " sensor with automatic exposure; type exposures=null, or switch it on (bundled"
                " sensors do with exposure_rule=centre)"
            )
        sensor.at_exposure(exposure)
