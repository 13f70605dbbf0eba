"""Lens prescriptions: surfaces, glasses, coatings and stop of a real lens, read from YAML; scaled,
stopped down, focused.

A prescription is a list of rows from front to back. A row holds a surface and the medium behind it:

    {radius_mm, thickness_mm, glass, conic, aspheric, odd_aspheric, semi_diameter_mm, coating, role}
    {stop: true, thickness_mm, semi_diameter_mm}

`radius_mm` is .inf (a plane) by default, and `glass` is air. `aspheric` is [a4, a6, ...],
`odd_aspheric` [a3, a5, ...]. The sensor lies `thickness_mm` behind the last row or, without this
key, in the paraxial focus at `reference_nm`. Rows with `role` infrared_filter or cover_glass are
the plates of a camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.physics.optics import glass, paraxial
from isethdr_core.physics.optics.surfaces import Surface

from .coatings import COATINGS

FOLDER = Path(__file__).parent / "presets"
ROLES = ("lens", "infrared_filter", "cover_glass")
ROW = (
    "radius_mm",
    "thickness_mm",
    "glass",
    "conic",
    "aspheric",
    "odd_aspheric",
    "semi_diameter_mm",
    "coating",
    "role",
    "stop",
)
HEAD = ("name", "source", "f_number", "half_field_deg", "reference_nm", "surfaces")


@dataclass(frozen=True)
class Prescription:
    """A lens as surfaces; the last surface is the sensor."""

    name: str
    source: str
    surfaces: tuple[Surface, ...]
    media: tuple[str, ...]  # in front of the first surface, between surfaces, behind the sensor
    coatings: tuple[str, ...]  # coating of each surface
    f_number: float  # smallest f-number
    half_field_deg: float  # half of the design field
    reference_nm: float = 587.56

    def indices(self, wavelength_nm: float | np.ndarray) -> list[float | np.ndarray]:
        """Return the refractive index of every medium; the entries of equal media are the same
        object.
        """
        try:
            index_of = {m: glass.index(m, wavelength_nm) for m in set(self.media)}
        except ValueError as err:
            raise ConfigError(f"prescription {self.name!r}: {err}") from None
        return [index_of[m] for m in self.media]

    @property
    def stop(self) -> int:
        """The index of the surface that is the stop."""
        return next(k for k, s in enumerate(self.surfaces) if s.is_stop)

    def focal_length_mm(self, wavelength_nm: float | None = None) -> float:
        """Return the paraxial focal length, mm; without a wavelength at `reference_nm`."""
        return paraxial.focal_length_mm(
            self.surfaces[:-1], self.indices(wavelength_nm or self.reference_nm)
        )

    def scaled(self, focal_length_mm: float) -> Prescription:
        """Return the lens with all lengths multiplied, so that it has this focal length."""
        s = focal_length_mm / self.focal_length_mm()
        return replace(
            self,
            surfaces=tuple(
                replace(
                    t,
                    z_mm=t.z_mm * s,
                    curvature_per_mm=t.curvature_per_mm / s,
                    semi_diameter_mm=t.semi_diameter_mm * s,
                    aspheric=tuple(
                        a * s ** (1 - power) for power, a in zip(range(4, 99, 2), t.aspheric)
                    ),
                    odd=tuple(a * s ** (1 - power) for power, a in zip(range(3, 99, 2), t.odd)),
                )
                for t in self.surfaces
            ),
        )

    def stopped(self, f_number: float) -> Prescription:
        """Return the lens with a stop of such a size that the paraxial entrance pupil has the
        diameter focal length / f-number.

        Raises
        ------
        ConfigError : the f-number is below that of the prescription, or below 0.5.
        """
        _check_f_number(f_number, self.name)
        if f_number < self.f_number * (1 - 1e-9):
            raise ConfigError(
                f"prescription {self.name!r} opens to f/{self.f_number:g}; f/{f_number:g} is more"
                f" than its surfaces pass; type lens.f_number={self.f_number:g} or choose another"
                " prescription"
            )
        wide = paraxial.entrance_pupil(self.surfaces[:-1], self.indices(self.reference_nm))[1]
        shrink = self.focal_length_mm() / f_number / 2 / wide
        stop = self.surfaces[self.stop]
        surfaces = list(self.surfaces)
        surfaces[self.stop] = replace(stop, semi_diameter_mm=stop.semi_diameter_mm * shrink)
        return replace(self, surfaces=tuple(surfaces))

    def with_coating(self, coating: str) -> Prescription:
        """Return the lens with one coating on every surface between glass and air. The coating
        `infrared_cut` of filters is kept.
        """
        check_coating(coating)
        return replace(
            self, coatings=tuple(coating if c != "infrared_cut" else c for c in self.coatings)
        )


def check_coating(coating: str) -> None:
    """Raise ConfigError unless there is a coating of this name."""
    if coating not in COATINGS:
        raise ConfigError(f"coating {coating!r} is unknown{did_you_mean(coating, COATINGS)}")


def names() -> list[str]:
    """Return the prescriptions that come with this plugin."""
    return sorted(p.stem for p in FOLDER.glob("*.yaml"))


def own_files(name: str) -> tuple[Path, ...]:
    """Return the user's own file that a name is the path of; none for a bundled prescription."""
    is_path = str(name).endswith((".yaml", ".yml"))
    return (Path(name).expanduser(),) if is_path else ()


def load(name: str) -> Prescription:
    """Return a prescription by its name, or from a YAML file by its path."""
    own = own_files(name)
    path = own[0] if own else FOLDER / f"{name}.yaml"
    if not path.is_file():
        raise ConfigError(
            f"prescription {str(name)!r} is unknown{did_you_mean(name, names())}, or give the path"
            " of a .yaml file"
        )
    return _read(str(path), path.stat().st_mtime_ns)


@lru_cache(maxsize=32)
def _read(path: str, _changed: int) -> Prescription:
    import yaml

    try:
        data = yaml.safe_load(Path(path).read_text())
    except (yaml.YAMLError, OSError, UnicodeDecodeError) as err:
        why = " ".join(str(err).split())
        raise ConfigError(
            f"prescription {path} cannot be read ({why}); expected YAML as the bundled ones "
            f"have it: {', '.join(names())}"
        ) from None
    return parse(data)


def parse(data: dict) -> Prescription:
    """Return the prescription that a mapping states; every value is checked.

    Raises
    ------
    ConfigError : a key, glass, coating or role is unknown; a value is not allowed; there is not
        exactly one stop, or it lies outside the lens; the lens forms no image; or the f-number is
        below 0.5.
    """
    if (
        not isinstance(data, dict)
        or not isinstance(data.get("surfaces"), list)
        or not data["surfaces"]
    ):
        raise ConfigError(
            f"a prescription is a mapping with {', '.join(HEAD)}; expected at least one row in"
            " 'surfaces'"
        )
    for number, row in enumerate(data["surfaces"], 1):
        if not isinstance(row, dict):
            raise ConfigError(
                f"prescription surface {number} is {row!r}; expected a mapping with some of "
                f"{', '.join(ROW)}"
            )
    name = str(data.get("name", "unnamed"))
    _check_keys(name, data, HEAD)
    _check_f_number(data.get("f_number"), name)
    rows = data["surfaces"]
    reference = _number(name, data, "reference_nm", 587.56)
    half_field_deg = _number(name, data, "half_field_deg", 20.0)
    if not 0 < half_field_deg < 90:
        raise ConfigError(
            f"prescription {name!r}: half_field_deg is {half_field_deg:g}; expected degrees above 0"
            " and below 90"
        )
    surfaces = []
    media = ["air"]
    coatings = []
    z = 0.0
    for number, row in enumerate(rows, 1):
        where = f"prescription {name!r}, surface {number}"
        surfaces.append(_surface(where, row, z))
        media.append(media[-1] if row.get("stop") else str(row.get("glass", "air")))
        coatings.append(_coating(where, row, media))
        z += _thickness(where, row)
    _check_stop(name, surfaces, media)
    lens = Prescription(
        name,
        str(data.get("source", "")),
        (*surfaces, Surface(z)),
        (*media, media[-1]),
        (*coatings, "none"),
        _number(name, data, "f_number", 0.0),
        half_field_deg,
        reference,
    )
    if media[-1] != "air":
        raise ConfigError(
            f"prescription {name!r} ends in {media[-1]}; expected air before the sensor: give the"
            " last surface"
        )
    power = lens.focal_length_mm()
    if not 0 < power < np.inf:
        raise ConfigError(
            f"prescription {name!r} has a focal length of {power:g} mm; expected a lens that makes"
            " an image"
        )
    if surfaces[lens.stop].z_mm < next(s.z_mm for s in surfaces if not s.is_stop) - power:
        raise ConfigError(
            f"prescription {name!r}: the stop lies outside the lens, more than a focal length"
            f" ({power:g} mm) in front; expected closer"
        )
    if "thickness_mm" not in rows[-1]:
        back = paraxial.back_focus_mm(surfaces, lens.indices(reference))
        if not back > 0:
            raise ConfigError(
                f"prescription {name!r} focuses {back:g} mm behind its last surface; expected a"
                " distance above 0"
            )
        lens = replace(lens, surfaces=(*surfaces, Surface(z + back)))
    return lens


def _surface(where: str, row: dict[str, float | str], z: float) -> Surface:
    _check_keys(where, row, ROW)
    radius = _number(where, row, "radius_mm", np.inf)
    if radius == 0 or np.isnan(radius):
        raise ConfigError(
            f"{where}: radius_mm is {radius:g}; expected millimetres, .inf for a plane"
        )
    semi = _number(where, row, "semi_diameter_mm", np.inf)
    if not semi > 0 or (row.get("stop") and semi == np.inf):
        raise ConfigError(
            f"{where}: semi_diameter_mm is {semi:g}; expected above 0, and finite for the stop"
        )
    if row.get("role", "lens") not in ROLES:
        raise ConfigError(f"{where}: role {row['role']!r}{did_you_mean(row['role'], ROLES)}")
    return Surface(
        z,
        1 / radius,
        _number(where, row, "conic", 0.0),
        _coefficients(where, row, "aspheric"),
        semi,
        bool(row.get("stop", False)),
        _coefficients(where, row, "odd_aspheric"),
    )


def _number(where: str, row: dict[str, float | str], key: str, default: float) -> float:
    """Return the number under a key of a mapping."""
    value = row.get(key, default)
    if not isinstance(value, (int, float)) or isinstance(value, bool) or np.isnan(value):
        raise ConfigError(f"{where}: {key} is {value!r}; expected a number")
    return float(value)


def _coefficients(where: str, row: dict[str, Any], key: str) -> tuple[float, ...]:
    """Return the list of finite numbers under a key of a mapping; empty without the key."""
    values = row.get(key, ())
    try:
        # YAML reads 1e-5 as text, because it has no decimal point
        coefficients = tuple(map(float, values)) if isinstance(values, list | tuple) else None
    except (TypeError, ValueError):
        coefficients = None
    if coefficients is None or not np.isfinite(coefficients).all():
        raise ConfigError(
            f"{where}: {key} is {values!r}; expected a list of numbers, for example [1.0e-5]"
        )
    return coefficients


def _thickness(where: str, row: dict[str, float | str]) -> float:
    thickness = _number(where, row, "thickness_mm", 0.0)
    if not 0 <= thickness < np.inf:
        raise ConfigError(
            f"{where}: thickness_mm is {thickness:g}; expected 0 or more: light goes from front to"
            " back"
        )
    return thickness


def _coating(where: str, row: dict[str, float | str], media: Sequence[str]) -> str:
    coating = str(row.get("coating", "none"))
    if coating not in COATINGS:
        raise ConfigError(
            f"{where}: coating {coating!r} is unknown{did_you_mean(coating, COATINGS)}"
        )
    if coating != "none" and "air" not in media[-2:]:
        raise ConfigError(
            f"{where}: a coating between {media[-2]} and {media[-1]}; expected one between glass"
            " and air"
        )
    if media[-1] not in glass.SELLMEIER:
        try:
            glass.index(media[-1], 550.0)
        except ValueError as err:
            raise ConfigError(f"{where}: {err}") from None
    return coating


def _check_stop(name: str, surfaces: Sequence[Surface], media: Sequence[str]) -> None:
    stops = [k for k, s in enumerate(surfaces) if s.is_stop]
    if len(stops) != 1:
        raise ConfigError(
            f"prescription {name!r} has {len(stops)} stops; expected one row with stop: true"
        )
    [stop] = stops
    if media[stop] != "air":
        raise ConfigError(
            f"prescription {name!r}: the stop is inside {media[stop]}; expected in air"
        )
    if stop == len(surfaces) - 1:
        raise ConfigError(
            f"prescription {name!r}: the stop lies outside the lens, behind its last surface;"
            " expected between its surfaces or in front"
        )


def _check_keys(where: str, data: dict[str, float | str], allowed: tuple[str, ...]) -> None:
    for key in data:
        if key not in allowed:
            raise ConfigError(f"{where}: key {key!r} is unknown{did_you_mean(key, allowed)}")


def _check_f_number(f_number: float, name: str) -> None:
    if not isinstance(f_number, int | float) or not f_number >= 0.5:
        raise ConfigError(
            f"prescription {name!r}: f_number is {f_number!r}; expected at least 0.5, the limit of"
            " an aplanatic lens in air"
        )
