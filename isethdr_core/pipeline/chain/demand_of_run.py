"""Demand of a run: what the scores need of the scene, derived backwards through the chain.

Everything that no score needs is stated in the ledger.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ...data.quantities import LABELS
from ...motion.visible_motion import LABELS as LABELS_OF_MOTION
from ...plugins.protocols import KnowsItsField, MovesInTime
from ...runs.seeds import generator
from ...uncertainty import budget, ledger, spending
from ...uncertainty.ledger import Ledger
from .. import bands, memory, overscan
from ..demand import Demand
from ..field_check import state_field
from ..imaging_plan import FieldAhead, ImagingOutline, LightBudget, in_focus, outlined
from ..noise_limit import CameraNoise
from .components import Chain
from .imaging_stage import on_sensor
from .narrowing import narrowed, union


def plan(chain: Chain, rows: Ledger) -> Demand:
    """Return the demand on the scene, derived backwards from the scores. Everything that is left
    out is stated in `rows`.

    Raises
    ------
    ConfigError : this machine has too little memory for the frame, the lens, or the pixels.
    """
    with ledger.stage(rows, "plan"):
        ledger.error(
            0.0,
            "1",
            "bound",
            "a plan changes no number; each omission below states its own bound",
        )
        state_field(chain.scene, chain.lens)
        if chain.leave_out:
            demand = demand_of_scores(chain)
            has_response = demand.response is not None
        else:
            sensed = demand_of_sensors(chain, Demand())
            has_response = sensed.response is not None
            demand = Demand(
                labels=frozenset(LABELS),
                error_allowed=sensed.error_allowed,
                stored_error_allowed=sensed.stored_error_allowed,
            )
        check_memory(chain, demand)
        if not has_response:  # the noise of the sensors is not known, so it sets no limit
            return demand
        sharp = replace(chain, lens=in_focus(chain.lens))
        imaged = partial(on_sensor, sharp, demand=demand)
        limit = CameraNoise(chain.lighting, sharp.lens, chain.cameras, imaged, generator())
        return replace(demand, noise_limit=limit)


def demand_of_scores(chain: Chain) -> Demand:
    """Return the demand of the scores on the scene: each component narrows it, from the metrics to
    the lightings.
    """
    state_unreported(chain)
    offered_nm = bands.offered_nm(chain.renderer or chain.scene)
    demand = Demand(wavelength_nm=offered_nm)
    for metric in chain.metrics.values():
        demand = narrowed(metric, demand)
    demand = narrowed(chain.isp, demand)
    demand = demand_of_sensors(chain, demand)
    for flare in chain.flares.values():
        demand = narrowed(flare, demand)
    demand = narrowed(chain.lens, demand)
    if chain.motion is not None and isinstance(chain.scene, MovesInTime):
        demand = demand.with_labels(*LABELS_OF_MOTION)
    state_labels(chain, demand)
    outline = imaging_outline(chain, demand, offered_nm)
    ledger.record_left_out(*outline.left_out)
    needed_nm = bands.for_sensors_and_truth(offered_nm, demand.wavelength_nm)
    lightings = chain.lighting, *chain.versions.values()
    demand = overscan.left_out_where_unseen(
        replace(demand, wavelength_nm=needed_nm), chain.renderer, outline, lightings
    )
    return union([narrowed(lighting, demand) for lighting in lightings])


def demand_of_sensors(chain: Chain, demand: Demand) -> Demand:
    """Return the union of the sensors' demands, with the accuracy that the light needs. The
    accuracy also applies to stored light, and even if nothing is left out.
    """
    return budget.budgeted(
        union([narrowed(sensor, demand) for sensor in chain.cameras.values()]),
        chain.allowed,
        chain.shares or budget.division(spending.of_chain(chain)),
    )


def relative_allowed(chain: Chain) -> float:
    """Return the relative error allowed of all light after the radiance; 0: exact computation."""
    union_of_sensors = ledger.collected(
        lambda: union([narrowed(sensor, Demand()) for sensor in chain.cameras.values()])
    )
    response = union_of_sensors.result.response
    if response is None:
        return 0.0
    return replace(response, noise_fraction_allowed=chain.allowed.noise_fraction).error_allowed


def imaging_outline(
    chain: Chain, demand: Demand, offered_nm: tuple[float, ...] | None
) -> ImagingOutline:
    """Return the outline of the lens's plan for the light that `demand` asks for.

    Parameters
    ----------
    chain : components of the run.
    demand : demand of the sensors, narrowed by flares and lens.
    offered_nm : all bands of the light; None if they are not known in advance.
    """
    size = chain.scene.camera_field() if isinstance(chain.scene, KnowsItsField) else None
    budgeted = LightBudget(demand.error_allowed, demand.window_m, demand.wavelength_nm)
    flares = tuple(chain.flares.values())
    return outlined(chain.lens, flares, FieldAhead(size, offered_nm), budgeted)


def check_memory(chain: Chain, demand: Demand) -> None:
    """Raise ConfigError if the data that `demand` asks for exceed the memory of this machine."""
    memory.check_run(
        chain.renderer or chain.scene,
        chain.scene,
        chain.lens,
        tuple(chain.flares.values()),
        tuple(chain.cameras.values()),
        frame_of(chain, demand),
    )


def frame_of(chain: Chain, demand: Demand) -> memory.Frame | None:
    """Return the tiles and bands of the light in a run; None if scene and renderer do not state
    them.
    """
    source = chain.renderer or chain.scene
    wavelength_nm = demand.wavelength_nm or bands.offered_nm(source)
    has_response = demand.response is not None
    return memory.frame_of(source, chain.scene, wavelength_nm, demand.margin, has_response)


def state_unreported(chain: Chain) -> None:
    """State what is left out because the run makes no report."""
    if not chain.reported:
        ledger.left_out(
            "display view of the scene",
            "no report is asked for, and only it shows it",
            0.0,
            "cd/m2",
            needless=True,
        )
    for version in chain.unreported:
        ledger.left_out(
            f"lighting {version}, and light groups that it alone needs",
            "no report is asked for, and only it shows them",
            0.0,
            "cd/m2",
            needless=True,
        )


def state_labels(chain: Chain, demand: Demand) -> None:
    """State which labels a renderer need not make."""
    unread = [label for label in LABELS if label not in demand.labels]
    if chain.renderer is not None and unread:
        ledger.left_out(
            f"labels {', '.join(unread)}",
            "neither a metric nor the lens nor motion reads them",
            0.0,
            "labels",
            needless=True,
        )
