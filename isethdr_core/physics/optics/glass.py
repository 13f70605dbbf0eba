"""Glasses: refractive index as a function of wavelength, from published dispersion formulas.

Sellmeier's formula is n^2 - 1 = sum of B L^2 / (L^2 - C), with the wavelength L in micrometres.
Sources: Schott optical glass catalogue of 2017-01-20 (N-, SF, F glasses, indices in air); I. H.
Malitson, J. Opt. Soc. Am. 55, 1205 (1965), fused silica; M. J. Dodge, Appl. Opt. 23, 1980 (1984),
MgF2, ordinary ray.
"""

from __future__ import annotations

import difflib

import numpy as np

# name: (B1, B2, B3), (C1, C2, C3) in um^2, (shortest, longest) wavelength of the source, nm
SELLMEIER = {
    "N-BK7": (
        (1.03961212, 0.231792344, 1.01046945),
        (0.00600069867, 0.0200179144, 103.560653),
        (300, 2500),
    ),
    "N-SK2": (
        (1.28189012, 0.257738258, 0.96818604),
        (0.0072719164, 0.0242823527, 110.377773),
        (310, 2500),
    ),
    "N-SK4": (
        (1.32993741, 0.228542996, 0.988465211),
        (0.00716874107, 0.0246455892, 100.886364),
        (334, 2500),
    ),
    "N-SK16": (
        (1.34317774, 0.241144399, 0.994317969),
        (0.00704687339, 0.0229005, 92.7508526),
        (310, 2500),
    ),
    "N-SSK2": (
        (1.4306027, 0.153150554, 1.01390904),
        (0.00823982975, 0.0333736841, 106.870822),
        (334, 2500),
    ),
    "N-BAK4": (
        (1.28834642, 0.132817724, 0.945395373),
        (0.00779980626, 0.0315631177, 105.965875),
        (334, 2500),
    ),
    "F2": (
        (1.34533359, 0.209073176, 0.937357162),
        (0.00997743871, 0.0470450767, 111.886764),
        (320, 2500),
    ),
    "F5": (
        (1.3104463, 0.19603426, 0.96612977),
        (0.00958633048, 0.0457627627, 115.011883),
        (320, 2500),
    ),
    "SF5": (
        (1.46141885, 0.247713019, 0.949995832),
        (0.0111826126, 0.0508594669, 112.041888),
        (350, 2500),
    ),
    "N-SF11": (
        (1.73759695, 0.313747346, 1.89878101),
        (0.013188707, 0.0623068142, 155.23629),
        (370, 2500),
    ),
    "fused_silica": (
        (0.6961663, 0.4079426, 0.8974794),
        (0.0684043**2, 0.1162414**2, 9.896161**2),
        (210, 3710),
    ),
    "MgF2": (
        (0.48755108, 0.39875031, 2.3120353),
        (0.04338408**2, 0.09461442**2, 23.793604**2),
        (200, 7000),
    ),
}
D_LINE_NM = 587.56
# range in which the two numbers nd and Vd (Abbe number) describe a glass well enough
MODEL_RANGE_NM = (380.0, 780.0)


def index(glass: str, wavelength_nm: float | np.ndarray) -> float | np.ndarray:
    """Return the refractive index of a glass relative to air.

    Parameters
    ----------
    glass : one of four forms: a name of `SELLMEIER` or "air"; a number (the same index at all
        wavelengths); "nd/Vd", for example "1.6204/60.3": Cauchy's n = A + B / L^2 with nd at 587.56
        nm and the Abbe number Vd between 486.13 and 656.27 nm; or a formula of `FORMULAS` with its
        coefficients and range in nm: "sellmeier:B1,C1,B2,C2,B3,C3@310-2500",
        "schott:a0,...,a5@...", "conrady:n0,a,b@...".
    wavelength_nm : one or more wavelengths, nm.

    Raises
    ------
    ValueError : the glass is unknown, its index is below 1, or it is not defined at a wavelength.
    """
    wave = np.asarray(wavelength_nm, float)
    if glass == "air":
        return np.ones_like(wave)
    number = _number(glass)
    if number is not None:
        if not 1 <= number < 5:
            raise ValueError(f"refractive index {number:g}; expected 1 to 5")
        return np.full_like(wave, number)
    if ":" in str(glass):
        return _formula(str(glass), wave)
    if "/" in str(glass):
        return _cauchy(str(glass), wave)
    if glass not in SELLMEIER:
        near = difflib.get_close_matches(str(glass), SELLMEIER, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(
            f"glass {glass!r} is unknown{hint} (one of: air, {', '.join(SELLMEIER)}, a number, or"
            " nd/Vd)"
        )
    strengths, resonances, limits = SELLMEIER[glass]
    _check_range(glass, wave, limits)
    square = (wave * 1e-3) ** 2
    return np.sqrt(1 + sum(b * square / (square - c) for b, c in zip(strengths, resonances)))


def _formula(glass: str, wave: np.ndarray) -> float | np.ndarray:
    kind, _, coefficients_text = glass.partition(":")
    numbers, _, limits = coefficients_text.partition("@")
    try:
        values = [float(v) for v in numbers.split(",")]
        low, high = (float(v) for v in limits.split("-"))
    except ValueError:
        raise ValueError(f"glass {glass!r}; expected <formula>:<coefficients>@<nm>-<nm>") from None
    if kind not in FORMULAS:
        raise ValueError(f"glass {glass!r}: expected one of the formulas {', '.join(FORMULAS)}")
    if len(values) not in COUNTS[kind]:
        raise ValueError(
            f"glass {glass!r} has {len(values)} coefficients; expected {EXPECTED[kind]}"
        )
    _check_range(glass, wave, (low, high))
    with np.errstate(invalid="ignore", divide="ignore"):
        indices = FORMULAS[kind](values, wave * 1e-3)
    wrong = np.ravel(indices)[~((np.ravel(indices) >= 1) & (np.ravel(indices) < 5))]
    if wrong.size:
        raise ValueError(f"glass {glass!r} has the refractive index {wrong[0]:g}; expected 1 to 5")
    return indices


def _sellmeier(values: list[float], um: float | np.ndarray) -> float | np.ndarray:
    """Return n from n^2 - 1 = sum of B L^2 / (L^2 - C); `values` are B1, C1, B2, C2, ..."""
    terms = (b * um**2 / (um**2 - c) for b, c in zip(values[::2], values[1::2]))
    return np.sqrt(1 + sum(terms))


def _schott(values: list[float], um: float | np.ndarray) -> float | np.ndarray:
    """Return n from n^2 = a0 + a1 L^2 + a2 L^-2 + a3 L^-4 + ... (Schott, before 1992)."""
    square = values[0] + values[1] * um**2
    return np.sqrt(square + sum(a * um ** (-2.0 * k) for k, a in enumerate(values[2:], 1)))


def _conrady(values: list[float], um: float | np.ndarray) -> float | np.ndarray:
    """Return n = n0 + a / L + b / L^3.5 (Conrady 1929)."""
    return values[0] + values[1] / um + values[2] * um**-3.5


FORMULAS = {"sellmeier": _sellmeier, "schott": _schott, "conrady": _conrady}
# numbers of coefficients that each formula takes, and how a message states them
COUNTS = {"sellmeier": range(2, 100, 2), "schott": range(2, 100), "conrady": range(3, 4)}
EXPECTED = {"sellmeier": "pairs of B and C", "schott": "at least a0 and a1", "conrady": "n0, a, b"}


def _number(glass: str) -> float | None:
    try:
        return float(glass)
    except ValueError:
        return None


def _cauchy(glass: str, wave: np.ndarray) -> float | np.ndarray:
    try:
        nd, abbe = map(float, glass.split("/"))
    except ValueError:
        raise ValueError(f"glass {glass!r}; expected nd/Vd as 1.6204/60.3") from None
    if not (1 < nd < 3 and 10 < abbe < 120):
        raise ValueError(
            f"glass {glass!r}: nd {nd:g}, Abbe's number {abbe:g}; expected 1 to 3 and 10 to 120"
        )
    _check_range(glass, wave, MODEL_RANGE_NM)
    slope = (nd - 1) / abbe / (486.13**-2 - 656.27**-2)
    return nd + slope * (wave**-2 - D_LINE_NM**-2)


def _check_range(glass: str, wave: np.ndarray, limits: tuple[int, int]) -> None:
    low, high = limits
    waves = np.ravel(wave)
    outside = waves[~((waves >= low) & (waves <= high))]  # also NaN
    if outside.size:
        raise ValueError(
            f"glass {glass} is undefined at {outside[0]:g} nm; expected {low:g} to {high:g} nm"
        )
