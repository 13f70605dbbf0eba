"""Files of EULUMDAT (Stockmar 1990): candela per 1000 lm in C planes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError

from .angles import MeasuredLamp, checked_candela, from_polar

HEAD_LINES = 26  # lines up to and with the number of lamp sets
SET_LINES = 6
RATIO_LINES = 10
END_OF_FILE = "\x1a\0"  # programs of DOS end a text with the first, and fill up with the second


def read_ldt(path: Path) -> MeasuredLamp:
    """Return the lamp of a file.

    Raises
    ------
    ConfigError : the file does not conform to EULUMDAT, states several sets of lamps, no flux
        or wrong intensities (NaN, infinite or negative), or has no light in front of the lamp.
    """
    text = path.read_text(encoding="latin-1").rstrip(END_OF_FILE + " \r\n")
    # `splitlines` would also end lines at bytes that are letters in other encodings
    lines = [line.strip() for line in text.split("\n")]
    number = lambda line: float(lines[line - 1].replace(",", "."))
    try:
        symmetry = int(number(3))
        planes = int(number(4))
        angles = int(number(6))
        factor = number(24)
        sets = int(number(HEAD_LINES))
        # a lamp set has six lines: number of lamps, kind, flux, colour, colour rendering, power
        flux = [number(HEAD_LINES + SET_LINES * k + 3) for k in range(sets)]
        first = HEAD_LINES + SET_LINES * sets + RATIO_LINES
        values = np.array([float(v.replace(",", ".")) for v in lines[first:] if v])
        c_deg, gamma_deg, candelas = np.split(values, [planes, planes + angles])
        stored_planes = {
            0: planes,
            1: 1,
            2: planes // 2 + 1,
            3: planes // 2 + 1,
            4: planes // 4 + 1,
        }
        stored = stored_planes[symmetry]
    except (ValueError, IndexError, KeyError, OverflowError):  # the last one: an infinite count
        raise ConfigError(
            f"{path.name} ends early or holds other lines than EULUMDAT has; expected its 26 lines,"
            " the lamp sets, ratios, angles and candela per 1000 lm"
        ) from None
    if sets != 1:
        told = ", ".join(f"{lumens:g} lm" for lumens in flux) or "none"
        raise ConfigError(
            f"{path.name} states {sets} sets of lamps ({told}), which may be alternatives or used"
            f" together; expected one set; keep the {SET_LINES} lines of one set with the flux that"
            f" is meant, and write 1 in line {HEAD_LINES}"
        )
    if not 0 < flux[0] < np.inf:
        raise ConfigError(
            f"{path.name} states a flux of {flux[0]:g} lm in line {HEAD_LINES + 3}, by which its"
            " candela per 1000 lm are multiplied; expected more than 0; write the flux of the lamp"
            " there"
        )
    if len(candelas) != stored * angles:
        raise ConfigError(
            f"{path.name} has {len(candelas)} values of candela after its angles; expected"
            f" {stored} planes of {angles} values each, {stored * angles}, by its symmetry"
            f" {symmetry} and its lines 4 and 6; correct these lines or the values of the file"
        )
    _check_angles(path, symmetry, c_deg, gamma_deg)
    candelas = checked_candela(path.name, candelas * factor * flux[0] / 1000)
    c_deg, candela = _whole_turn(symmetry, c_deg, candelas.reshape(stored, angles))
    return from_polar(path.name, c_deg, gamma_deg, candela)


def _check_angles(path: Path, symmetry: int, c_deg: np.ndarray, gamma_deg: np.ndarray) -> None:
    """Raise ConfigError unless the planes rise from 0 to below 360 degrees, and gamma rises or
    falls.
    """
    turn = np.diff([*c_deg, 360.0])
    if symmetry != 1 and not (len(c_deg) and c_deg[0] == 0 and (turn > 0).all()):
        raise ConfigError(
            f"{path.name} has C planes at {_told(c_deg)} degrees; expected angles that rise from 0"
            " to below 360"
        )
    steps = np.diff(gamma_deg)
    if not (len(steps) and ((steps > 0).all() or (steps < 0).all())):
        raise ConfigError(
            f"{path.name} has intensities at gamma {_told(gamma_deg)} degrees; expected two or more"
            " angles that rise"
        )


def _told(angles_deg: np.ndarray) -> str:
    first = ", ".join(f"{angle:g}" for angle in angles_deg[:5])
    return first + ", ..." * (len(angles_deg) > 5)


def _whole_turn(
    symmetry: int, c_deg: np.ndarray, candela: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return C planes from 0 to 360 degrees and their intensities, completed by symmetry.

    Parameters
    ----------
    symmetry : 0: none; 1: the file holds one plane for all; 2: it holds C0 to C180; 3: C270 over C0
        to C90; 4: C0 to C90.
    c_deg : (planes,) angles of all planes, degrees.
    candela : (stored planes, angles) intensities.
    """
    all_planes = np.r_[c_deg, 360.0]
    if symmetry == 1:
        return np.array([0.0, 360.0]), np.repeat(candela, 2, 0)
    turn = np.mod(all_planes, 360)
    if symmetry == 3:
        half_turn = np.r_[c_deg[c_deg >= 270] - 360, c_deg[c_deg <= 90]]
        turn = np.where(turn >= 270, turn - 360, np.where(turn > 90, 180 - turn, turn))
    else:
        half_turn = c_deg[: len(candela)]
        if symmetry in (2, 4):
            turn = np.minimum(turn, 360 - turn)
        if symmetry == 4:
            turn = np.minimum(turn, 180 - turn)
    nearest = np.abs(turn[:, None] - half_turn).argmin(1)
    return all_planes, candela[nearest]
