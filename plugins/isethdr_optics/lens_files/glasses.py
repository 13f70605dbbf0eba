"""Glasses of lens files: by name, by catalogue file, by code, or by index.

Catalogue files .agf are the text files that Zemax and the makers of glass use. The line NM holds
the name and the number of the formula, CD the coefficients, and LD the range in micrometres.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.physics.optics import glass

from .lens_data import Problems

# numbers of the dispersion formulas in .agf files
SCHOTT = 1
SELLMEIER = 2
CONRADY = 5
LONG_SELLMEIER = 6
CODE = re.compile(r"(\d{3})(\d{3})|(0?\.?\d{3,6})\.(\d{3,6})")


def read_catalogue(path: Path) -> dict[str, str]:
    """Return the glasses of a .agf file, {name: argument of `physics.optics.glass.index`}.

    Glasses with other formulas than Schott, Sellmeier 1 and 3, and Conrady are left out.

    Raises
    ------
    CatalogError : the file cannot be read, or holds no glass.
    """
    try:
        data = path.read_bytes()
    except OSError as err:
        raise CatalogError(f"{path} cannot be read: {err.strerror}") from None
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "latin-1", "replace")
    glasses: dict[str, str] = {}
    name = ""
    formula = 0
    numbers = ""
    try:
        for line in text.splitlines():
            words = line.split()
            if line.startswith("NM ") and len(words) > 2:
                name = words[1]
                formula = int(float(words[2]))
                numbers = ""
            elif line.startswith("CD ") and name:
                numbers = _coefficients(formula, [float(w) for w in words[1:]])
            elif line.startswith("LD ") and numbers:
                low, high = (1e3 * float(w) for w in words[1:3])
                glasses[name] = f"{numbers}@{low:g}-{high:g}"
    except (ValueError, OverflowError):  # OverflowError: the number of a formula is infinite
        raise CatalogError(
            f"{path}: glass {name!r} has a line that is no list of numbers"
        ) from None
    if not glasses:
        raise CatalogError(f"{path} holds no glass; expected a catalogue with lines NM, CD and LD")
    return glasses


def _coefficients(formula: int, values: list[float]) -> str:
    names = {SCHOTT: "schott", SELLMEIER: "sellmeier", LONG_SELLMEIER: "sellmeier"}
    counts = {SCHOTT: 6, SELLMEIER: 6, CONRADY: 3, LONG_SELLMEIER: 8}
    if formula not in counts:
        return ""
    coefficients = values[: counts[formula]]
    return f"{names.get(formula, 'conrady')}:{','.join(repr(v) for v in coefficients)}"


def stated(options: Sequence[str]) -> dict[str, str]:
    """Return the glasses of the command line: catalogue files, NAME=nd/Vd and NAME=index.

    Raises
    ------
    ConfigError, CatalogError : an option or a catalogue file cannot be read.
    """
    coefficients_of: dict[str, str] = {}
    for option in options:
        name, equals, value = option.partition("=")
        if not equals:
            coefficients_of |= read_catalogue(Path(option).expanduser())
            continue
        try:
            glass.index(value, glass.D_LINE_NM)
        except ValueError as err:
            raise ConfigError(f"--glass {option}: {err}") from None
        coefficients_of[name] = value
    return coefficients_of


def resolve(name: str, glasses: Mapping[str, str], label: str, problems: Problems) -> str:
    """Return the argument of `physics.optics.glass.index` for a glass of a file.

    Names are compared without hyphens, without case, and without the maker's name after an
    underscore. An unknown glass is recorded in `problems`.

    Parameters
    ----------
    name : name of the glass in the file.
    glasses : {name: argument of `physics.optics.glass.index`} of the file and the command line.
    label : number of the surface, for messages.
    problems : record of the surfaces that cannot be imported.
    """
    if name in glasses:
        return glasses[name]
    simple_name = _simplified(name)
    for offered, value in glasses.items():
        if _simplified(offered) == simple_name:
            return value
    for offered in glass.SELLMEIER:
        if _simplified(offered) == simple_name:
            return offered
    match = CODE.fullmatch(name)
    if match and match[1]:  # 517642: nd 1.517, Abbe number 64.2
        return f"{1 + int(match[1]) / 1000:g}/{int(match[2]) / 10:g}"
    if match:  # 517000.642000: nd 1.517000, Abbe number 64.2000
        digits = match[3].replace(".", "").lstrip("0") or "0"
        return f"{1 + float('0.' + digits):.9g}/{float(match[4][:2] + '.' + match[4][2:]):.9g}"
    nearest = get_close_matches(name, [*glasses, *glass.SELLMEIER], 1)
    hint = f" (did you mean {nearest[0]!r}?)" if nearest else ""
    problems.add(
        label,
        f"glass {name!r} is unknown{hint}; type --glass <catalogue>.agf, or --glass"
        f" {name}=<nd>/<Vd>",
    )
    return "1.5"


def _simplified(name: str) -> str:
    return name.split("_")[0].replace("-", "").upper()
