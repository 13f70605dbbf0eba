"""Picture figures: the error of a picture in units of its own noise, with the time that it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import error_terms, ledger
from ..error_terms import ErrorTerm, Quantity, Source
from ..ledger import Row
from .captured_electrons import Electrons
from .pixel_errors import (
    UNIT,
    after,
    sensor_terms_without_electrons,
    terms_of_capture,
    terms_of_sensor,
)
from .share_within import within

if TYPE_CHECKING:
    import xarray as xr

# keys of the figures of a picture
RENDERER = "renderer"
AFTER_RENDERER = "all after the renderer"
SENSOR = "sensor"
WHOLE = "all stages"
TWO_SIDED = 2.5758  # 99 % of normal deviates are within this number of standard deviations


class Seconds(NamedTuple):
    """Run time of a picture, s."""

    rendering: float  # time of the rendering, in this run or when the radiance was stored
    later: float  # time of reading the radiance, and of lightings, lens, sensor and isp


@dataclass(frozen=True)
class Figures:
    """Errors of one capture, which 99 % of its unsaturated pixels do not exceed.

    The unit is the standard deviation of its noise.
    """

    all_stages: float
    renderer: float
    later: float  # stages after the renderer, up to the sensor
    sensor: float
    worst: float  # error of the worst pixel, 99th percentile
    capture: str


def figures_of(
    shot: Electrons, terms: Sequence[ErrorTerm], of_sensor: Sequence[ErrorTerm] = ()
) -> Figures | None:
    """Return the figures of one capture; None if all its pixels are saturated.

    Parameters
    ----------
    shot : the capture.
    terms : error terms of the stages after the renderer.
    of_sensor : error terms of the sensor, as `terms_of_sensor` returns them.
    """
    use = shot.unsaturated
    if not use.any():
        return None
    renderer = shot.renderer[use] / shot.sigma[use]
    bound, deviation = (e[use] / shot.sigma[use] for e in after(shot, terms))
    sensor_errors = [e[use] / shot.sigma[use] for e in after(replace(shot, maps=None), of_sensor)]
    bounds = bound + sensor_errors[0]
    deviations = np.sqrt(renderer**2 + deviation**2 + sensor_errors[1] ** 2)
    return Figures(
        all_stages=within(bounds, deviations),
        renderer=within(np.zeros_like(renderer), renderer),
        later=within(bound, deviation),
        sensor=within(*sensor_errors),
        worst=float((bounds + TWO_SIDED * deviations).max()),
        capture=shot.capture,
    )


def record_figures(
    shots: Sequence[Electrons], rows: Sequence[Row], allowed: float, seconds: Seconds
) -> None:
    """State the error of a picture in units of its own noise: of the worst capture, then of each.

    Parameters
    ----------
    shots : electrons of the captures, as `electrons` returns them.
    rows : rows of the ledger; among those of sensors, only the row of this picture's sensor.
    allowed : largest error of all stages after the renderer, as a share of the noise.
    seconds : run time of the picture.
    """
    terms = {shot.capture: terms_of_capture(shot, rows) for shot in shots}
    sensor_terms = terms_of_sensor(rows)
    figures = [
        figure
        for shot in shots
        if (figure := figures_of(shot, terms[shot.capture].of_electrons, sensor_terms))
    ]
    if not figures:
        label = "(no pixel is below saturation)"
        _record_figure(0.0, "statistical", label, WHOLE)
        return
    most = max(figures, key=lambda figure: figure.all_stages)
    label = (
        f"in 99 % of the unsaturated pixels of capture {most.capture} (worst pixel"
        f" {most.worst:.3g}); sensor {most.sensor:.3g}, renderer {most.renderer:.3g} in"
        f" {seconds.rendering:.3g} s, later stages {most.later:.3g} of the allowed {allowed:g} in"
        f" {seconds.later:.3g} s{_why(figures, shots, rows, allowed)}"
    )
    _record_figure(most.all_stages, "statistical", label, WHOLE)
    for figure in figures:
        of = f"electrons of {figure.capture}"
        _record_figure(figure.renderer, "statistical", f"{of}: renderer", RENDERER, figure.capture)
        label = f"{of}: all after the renderer"
        _record_figure(figure.later, "bound", label, AFTER_RENDERER, figure.capture)
        label = f"{of}: counted by the sensor"
        _record_figure(figure.sensor, "bound", label, SENSOR, figure.capture)
    if any(row.kind == "radiance" for row in rows) and not any(
        shot.renderer.any() for shot in shots
    ):
        ledger.left_out(
            "noise of the renderer",
            "the renderer states none; it does with several passes, or with more samples",
            np.inf,
            UNIT,
        )
    without_electrons = terms[shots[-1].capture].without_electrons
    for term in [*without_electrons, *sensor_terms_without_electrons(rows)]:
        ledger.left_out(
            term.label or str(term.source),
            "it cannot be converted to an error of a pixel's electrons",
            term.value,
            term.unit,
        )


def _record_figure(
    value: float, how: error_terms.How, label: str, key: str, capture: str | None = None
) -> None:
    known = np.inf if np.isnan(value) else value
    term = ErrorTerm(Source(key=key), Quantity.ELECTRONS, capture, known, UNIT, how, label)
    ledger.record(term)


def _why(
    figures: Sequence[Figures], shots: Sequence[Electrons], rows: Sequence[Row], allowed: float
) -> str:
    """Return the largest cause of an error above the allowed one; "" if the error is allowed."""
    most = max(figures, key=lambda figure: figure.later)
    if most.later <= allowed:
        return ""
    shot = next(s for s in shots if s.capture == most.capture)
    alone = replace(shot, maps=None, renderer=np.zeros_like(shot.renderer))
    causes = [
        (_later(alone, [term]), term.label or str(term.source))
        for term in terms_of_capture(shot, rows).of_electrons
    ]
    if shot.maps:
        label = shot.maps.label or "errors that the lens states tile by tile"
        causes.append((_later(replace(alone, maps=shot.maps), []), label))
    share, label = max(causes, key=lambda cause: cause[0])
    return f"; more than allowed, {share:.3g} of it by: {label}"


def _later(shot: Electrons, terms: Sequence[ErrorTerm]) -> float:
    """Return the figure of a capture that is not all saturated, for these stages alone."""
    figures = figures_of(shot, terms)
    return figures.later if figures else 0.0


def seconds(rows: Sequence[Row], camera: str, scene: xr.Dataset) -> Seconds:
    """Return the run time of one camera's picture.

    Parameters
    ----------
    rows : rows of the ledger.
    camera : name of the camera.
    scene : scene radiance, whose attribute states its render time.
    """
    own = [
        row.seconds
        for row in rows
        if row.kind in ("radiance", "lighting", "lens")
        or row.stage in (f"sensor {camera}", f"isp {camera}")
    ]
    return Seconds(float(scene.attrs.get("rendered_s", 0.0)), sum(own))
