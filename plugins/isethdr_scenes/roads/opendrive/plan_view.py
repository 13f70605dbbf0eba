"""Plan view: the reference line of a road as elements `geometry`, in both directions."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import cast

import numpy as np
from scipy.optimize import brentq

from ..cubic_record import Cubic4, CubicRecord
from ..reference_line import Curve, Record, ReferenceLine
from .elements import MOST_COEFFICIENT, MOST_M, MOST_PLACE_M, Node, child

MOST_RAD = 1e4  # greatest turn of one geometry; beyond it a curvature or a length is damaged
LEAST_M = 1e-6  # shorter geometries are dropped
ARC_LENGTH = 1e-3  # larger relative differences from the stated length are noted
FORMS = ("line", "arc", "spiral", "poly3", "paramPoly3")


def read_line(road: Node) -> ReferenceLine:
    """Return the reference line of a road.

    Raises
    ------
    CatalogError : the road has no reference line; a length is negative; a form is unknown; a
        number is beyond reason.
    """
    records = []
    for number, node in enumerate(road.all("planView/geometry"), 1):
        record = _record(node.named(f"{road.where}, geometry {number}"))
        if record is not None:
            records.append(record)
    if not records:
        raise road.error("it has no reference line; expected <planView> with <geometry>")
    return ReferenceLine(tuple(records))


def _record(node: Node) -> Curve | None:
    form = next((node.first(name) for name in FORMS if node.first(name) is not None), None)
    if form is None:
        held = ", ".join(f"<{e.tag}>" for e in node.element) or "nothing"
        raise node.error(f"it holds {held}; expected one of {', '.join(FORMS)}")
    start, length = (node.number(name, most=MOST_M) for name in ("s", "length"))
    x, y = (node.number(name, most=MOST_PLACE_M) for name in "xy")
    heading = node.number("hdg", most=MOST_M)
    if length < 0:
        raise node.error(f"its length is {length:g} m; expected 0 or more")
    if length < LEAST_M:
        node.note("a geometry without length is left out")
        return None
    tag = form.element.tag
    if tag in ("line", "arc", "spiral"):
        names = {"line": (), "arc": ("curvature", "curvature"), "spiral": ("curvStart", "curvEnd")}
        bend = [form.number(name) for name in names[tag]] or [0.0, 0.0]
        sharpest = max(abs(bend[0]), abs(bend[1]))
        if sharpest * length > MOST_RAD:
            raise node.error(
                f"its curvature is {sharpest:g} /m over {length:g} m, a turn of more than"
                f" {MOST_RAD:g} rad; expected a smaller curvature or length"
            )
        return Record(start, x, y, heading, length, *bend)
    if tag == "poly3":
        v = _cubic(form, "")
        curve = CubicRecord(start, x, y, heading, length, (0.0, 1.0, 0.0, 0.0), v)
        return _poly3(curve)
    u, v = (_cubic(form, axis) for axis in ("U", "V"))
    last = length if form.text("pRange", "normalized") == "arcLength" else 1.0
    curve = CubicRecord(start, x, y, heading, length, u, v, last)
    speed = np.hypot(*curve._derivative(np.linspace(0.0, last, 65)))
    if not speed.min() > 1e-9 * max(speed.max(), 1e-9):
        raise node.error("its polynomials stand still or turn back; expected a smooth curve")
    if abs(curve.arc_length_m / length - 1) > ARC_LENGTH:
        node.note("a paramPoly3 has another arc length than stated; s is scaled to the stated one")
    return curve


def _cubic(form: Node, axis: str) -> Cubic4:
    numbers = (form.number(name + axis, most=MOST_COEFFICIENT) for name in "abcd")
    return cast(Cubic4, tuple(numbers))


def _poly3(curve: CubicRecord) -> CubicRecord:
    """Return the curve v(u) with the end at which it has its stated length."""
    far = _ended(curve, curve.length_m)
    excess = lambda u: _ended(curve, u).arc_length_m - curve.length_m
    if far.arc_length_m - curve.length_m <= 1e-9 * curve.length_m:
        return far
    return _ended(curve, float(brentq(excess, 1e-9 * curve.length_m, curve.length_m, xtol=1e-13)))


def _ended(curve: CubicRecord, last: float) -> CubicRecord:
    return CubicRecord(
        curve.start_m,
        curve.x_m,
        curve.y_m,
        curve.heading_rad,
        curve.length_m,
        curve.u,
        curve.v,
        last,
    )


def write_line(road: ET.Element, line: ReferenceLine) -> None:
    """Add the reference line to an element `road`."""
    view = child(road, "planView")
    for record in (r for r in line.records if r.length_m >= LEAST_M):
        node = child(
            view,
            "geometry",
            s=float(record.start_m),
            x=float(record.x_m),
            y=float(record.y_m),
            hdg=float(record.heading_rad),
            length=float(record.length_m),
        )
        if isinstance(record, Record):
            _write_record(node, record)
        elif isinstance(record, CubicRecord):
            _write_cubic(node, record)
        else:
            raise TypeError(f"{type(record).__name__} has no form in OpenDRIVE")


def _write_record(node: ET.Element, record: Record) -> None:
    first = float(record.curvature_per_m)
    last = float(record.end_per_m)
    if first != last:
        child(node, "spiral", curvStart=first, curvEnd=last)
    elif first:
        child(node, "arc", curvature=first)
    else:
        child(node, "line")


def _write_cubic(node: ET.Element, record: CubicRecord) -> None:
    """Write a cubic curve over p from 0 to 1."""
    powers = record.last ** np.arange(4)
    told = {}
    for axis, values in (("U", record.u), ("V", record.v)):
        scaled = np.array(values) * powers
        told |= {name + axis: float(value) for name, value in zip("abcd", scaled)}
    child(node, "paramPoly3", **told, pRange="normalized")
