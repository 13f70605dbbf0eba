"""Pixel errors: the stated errors of all stages as errors of the electrons of each pixel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...data.quantities import IRRADIANCE
from .. import error_terms
from ..error_terms import ErrorTerm, Quantity
from ..ledger import Row
from .captured_electrons import Electrons

UNIT = "standard deviations of the sensor's noise"
# kinds of the stages after the renderer whose errors propagate to the electrons. Of `radiance` only
# the rounding of the store counts: the errors that it restates are those of the renderer
AFTER = ("scene", "radiance", "lighting", "lens", "flare")
ELECTRONS = "electrons"  # unit
UNITS = (error_terms.RELATIVE, IRRADIANCE, ELECTRONS, UNIT)  # units that propagate to electrons


class Bounds(NamedTuple):
    """The errors (y, x) of one capture: bounds, and the standard deviation of statistical ones."""

    bound: np.ndarray
    deviation: np.ndarray


class TermsAfter(NamedTuple):
    """Errors of the stages after the renderer."""

    of_electrons: list[ErrorTerm]
    without_electrons: list[ErrorTerm]  # errors that do not propagate to electrons


def after(shot: Electrons, terms: Sequence[ErrorTerm]) -> Bounds:
    """Return the errors of `terms` in electrons of one capture, as bounds and deviations.

    Terms that do not propagate to electrons are skipped.
    """
    linear = np.zeros(shot.total.shape)
    squares = np.zeros(shot.total.shape)
    if shot.maps:
        linear = linear + shot.maps.bound
        squares = squares + shot.maps.deviation**2
    for term in terms:
        error_e = _in_electrons(term, shot)
        if error_e is None:
            continue
        if term.how == "statistical":
            squares += error_e**2
        else:
            linear += error_e
    return Bounds(linear, np.sqrt(squares))


def _in_electrons(term: ErrorTerm, shot: Electrons) -> np.ndarray | float | None:
    """Return the error of a term in electrons, (y, x) or one for all pixels; None if its unit does
    not propagate.
    """
    if term.unit == error_terms.RELATIVE:
        # a part that no stage declared is at most all light
        part = shot.parts.get(term.part, shot.total) if term.part else shot.total
        light: np.ndarray = np.abs(part)  # a part may be light that a stage takes away
        if np.isinf(term.value):  # no light has no error
            return np.where(light > 0, term.value, 0.0)
        return term.value * light
    if term.unit == IRRADIANCE:
        return term.value * shot.per_irradiance
    if term.unit == ELECTRONS:
        return term.value
    return term.value * shot.sigma if term.unit == UNIT else None


def terms_after(rows: Sequence[Row], replaced: Sequence[str] = ()) -> TermsAfter:
    """Return the errors of the stages after the renderer, up to the sensor.

    Parameters
    ----------
    rows : rows of a ledger. A restated term belongs to the stage of its source.
    replaced : keys of terms of the lens that are known pixel by pixel; they are left out.
    """
    terms = [
        term
        for row in rows
        for term in row.errors
        if term.source.kind in AFTER and term.acts_on != Quantity.TARGET
    ]
    with_electrons: list[ErrorTerm] = []
    without: list[ErrorTerm] = []
    for term in error_terms.largest_alternatives(terms):
        if term.unit not in UNITS or term.acts_on not in error_terms.LIGHT:
            without += [term] if term.value else []
        elif not (term.source.kind == "lens" and term.source.key in replaced):
            with_electrons.append(term)
    return TermsAfter(with_electrons, without)


def terms_of_capture(shot: Electrons, rows: Sequence[Row]) -> TermsAfter:
    """Return the errors of the stages after the renderer that count for one capture."""
    return terms_after(rows, shot.maps.replaces if shot.maps else ())


def terms_of_sensor(rows: Sequence[Row]) -> list[ErrorTerm]:
    """Return the errors of electrons that sensors state.

    Noise and non-linearity are properties of a sensor, not errors.
    """
    return [term for term in _light_terms_of_sensor(rows) if _counts_electrons(term)]


def sensor_terms_without_electrons(rows: Sequence[Row]) -> list[ErrorTerm]:
    """Return the errors of light that sensors state, and that do not propagate to electrons."""
    return [
        term for term in _light_terms_of_sensor(rows) if term.value and not _counts_electrons(term)
    ]


def _light_terms_of_sensor(rows: Sequence[Row]) -> list[ErrorTerm]:
    terms = [
        term
        for row in rows
        for term in row.errors
        if term.source.kind == "sensor" and term.acts_on in error_terms.LIGHT
    ]
    return error_terms.largest_alternatives(terms)


def _counts_electrons(term: ErrorTerm) -> bool:
    """Return whether an error of a sensor is one of its electrons, in a unit that propagates."""
    return term.acts_on == Quantity.ELECTRONS and term.unit in UNITS


def stated_noise(rows: Sequence[Row]) -> float:
    """Return the largest relative noise of a light group that a renderer states; 0 without one."""
    return max(
        (
            term.value
            for row in rows
            for term in row.errors
            if term.source.kind == "renderer"
            and (term.unit, term.how) == (error_terms.RELATIVE, "statistical")
        ),
        default=0.0,
    )
