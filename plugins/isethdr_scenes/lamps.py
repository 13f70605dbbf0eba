"""Lamps: intensity in candela, directions and spectrum of each kind of lamp.

The lamps of vehicles and bicycles are tables of candela over two angles, from the families of
`photometry.families`. Each is within the limits of its regulation: of the UN for vehicles, of the
German StVZO for bicycles (`photometry/rules.csv`). Street and tunnel luminaires and traffic signals
are tables of `photometry.luminaires`. Windows, panels and destination signs are Lambertian: their
luminance is the same in all directions. Their intensities are typical values.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from isethdr_core.scene import IntensityTable, Lamp

from .lamp_spectra import spectrum_of
from .photometry.families import family
from .photometry.luminaires import luminaire

# shares of a lamp's flux that its lens emits as a Lambertian surface
HEADLAMP_GLOW = 4e-3
LENS_GLOW = 0.02  # coloured and diffusing lenses


@dataclass(frozen=True)
class Kind:
    """One kind of lamp with the table of a `family` or a `luminaire`; Lambertian without a
    table.
    """

    group: str
    spectrum: str
    intensity_cd: float
    lambertian_share: float = 1e-3  # Lambertian share of the flux of a lamp with a table
    family: str = ""
    luminaire: str = ""  # a table of `photometry.luminaires` instead of a family


def _table(group: str, spectrum: str, name: str, glow: float = LENS_GLOW) -> Kind:
    """Return a kind with the table and the intensity of a family."""
    return Kind(group, spectrum, family(name).intensity_cd, lambertian_share=glow, family=name)


def _luminaire(
    name: str, spectrum: str = "sodium", group: str = "streetlights", glow: float = 1e-3
) -> Kind:
    """Return a kind with the table and the intensity of `photometry.luminaires`."""
    return Kind(group, spectrum, luminaire(name).intensity_cd, glow, luminaire=name)


KINDS = {
    # vehicle headlamps
    "low_beam": _table("headlights", "led_white", "dipped_r112_b", HEADLAMP_GLOW),
    # off while the dipped beam is on
    "daytime": _table("headlights", "led_white", "daytime"),
    "position": _table("headlights", "led_white", "front_position"),
    # signal lamps
    "tail": _table("other", "red", "rear_position"),
    "brake": _table("other", "red", "stop"),
    "brake_high": _table("other", "red", "stop_high"),
    "indicator_front": _table("other", "amber", "indicator_front"),
    "indicator_rear": _table("other", "amber", "indicator_rear"),
    "marker": _table("other", "amber", "side_marker"),
    "reverse": _table("other", "led_white", "reversing"),
    "bike_front": _table("other", "led_white", "bicycle_front"),
    "bike_tail": _table("other", "red", "bicycle_rear"),
    # luminaires behind a diffusing lens; their axes point towards the road
    "street": _luminaire("road", glow=LENS_GLOW),
    "tunnel": _luminaire("tunnel", "led_white", glow=LENS_GLOW),
    # amber destination sign, some 100 cd/m2
    "sign": Kind("other", "amber", 25),
    # lit room: some 10 cd/m2 over 1.2 m2
    "window": Kind("other", "led_warm", 12),
    # street luminaires by type of post
    "street_road": _luminaire("road"),
    "street_post_top": _luminaire("post_top"),
    "street_high_mast": _luminaire("high_mast"),
    "signal_red": _luminaire("signal", "red", "other", LENS_GLOW),
    "signal_amber": _luminaire("signal", "amber", "other", LENS_GLOW),
    "signal_green": _luminaire("signal", "green", "other", LENS_GLOW),
    # cd per square metre, which the builder multiplies by the area: shop window, panel of a bus
    # stop
    "shop_window": Kind("other", "led_white", 80),
    "panel": Kind("other", "led_white", 150),
}


def groups_of(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return the light groups of a scene with these kinds of lamps: `sky` first."""
    return ("sky", *sorted({KINDS[kind].group for kind in kinds}))


def lamp(kind: str, axis: tuple[float, float, float]) -> Lamp:
    """Return the lamp `kind` of `KINDS` that points along `axis` (model coordinates; any
    length).
    """
    k = KINDS[kind]
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    return Lamp(
        kind,
        k.group,
        float(k.intensity_cd),
        spectrum_of(k.spectrum),
        tuple(direction.tolist()),
        lambertian_share=k.lambertian_share,
        table=_table_of(k),
    )


def _table_of(kind: Kind) -> IntensityTable | None:
    if kind.luminaire:
        return luminaire(kind.luminaire).table
    return family(kind.family).table if kind.family else None


def lamp_of_family(kind: str, axis: tuple[float, float, float], name: str) -> Lamp:
    """Return the lamp `kind` with the table and the intensity of the family `name`.

    For example, the brake lamp of a motorcycle is a `brake` with another intensity.

    Parameters
    ----------
    kind : one of `KINDS`.
    axis : (3,) direction in which the lamp points, model coordinates, any length.
    name : family of `photometry.families`.
    """
    pattern = family(name)
    return replace(lamp(kind, axis), table=pattern.table, intensity_cd=pattern.intensity_cd)
