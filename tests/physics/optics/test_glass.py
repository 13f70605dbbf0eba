"""Glasses: indices and Abbe numbers of the makers' catalogue, model glasses, and refusals where no
index is defined.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics.glass import SELLMEIER, index

# spectral lines of helium and hydrogen, nm
D = 587.5618
F = 486.1327
C = 656.2725
# nd and Abbe's number as the catalogue prints them: 5 and 2 decimals
PRINTED = {
    "N-BK7": (1.5168, 64.17),
    "N-SK2": (1.60738, 56.65),
    "N-SK4": (1.61272, 58.63),
    "N-SK16": (1.62041, 60.32),
    "N-SSK2": (1.62229, 53.27),
    "N-BAK4": (1.56883, 55.98),
    "F2": (1.62004, 36.37),
    "F5": (1.60342, 38.03),
    "SF5": (1.6727, 32.21),
    "N-SF11": (1.78472, 25.68),
    "fused_silica": (1.45846, 67.82),
}


@pytest.mark.parametrize("name", PRINTED)
def test_index_and_abbe_number(name):
    nd, nf, nc = (float(index(name, w)) for w in (D, F, C))
    assert nd == pytest.approx(PRINTED[name][0], abs=6e-6)  # five printed decimals
    assert (nd - 1) / (nf - nc) == pytest.approx(PRINTED[name][1], abs=0.02)


def test_every_glass_disperses_normally_in_the_visible():
    wave = np.linspace(380, 780, 41)
    for name in SELLMEIER:
        assert np.all(np.diff(index(name, wave)) < 0)


def test_model_glass_has_its_two_numbers_and_follows_the_real_one():
    nd, nf, nc = (float(index("1.5168/64.17", w)) for w in (587.56, 486.13, 656.27))
    assert nd == pytest.approx(1.5168, abs=1e-12) and (nd - 1) / (nf - nc) == pytest.approx(
        64.17, rel=1e-9
    )
    wave = np.linspace(400, 700, 31)
    # 1e-3: two numbers determine a dispersion curve no better
    assert np.abs(index("1.5168/64.17", wave) - index("N-BK7", wave)).max() < 1e-3


def test_numbers_and_air():
    assert float(index("air", 550.0)) == 1.0 and float(index(1.5, 550.0)) == 1.5
    np.testing.assert_array_equal(index("1.7", [400.0, 500.0]), 1.7)


@pytest.mark.parametrize(
    ("glass", "wave", "said"),
    [
        ("N-BK8", 550.0, "did you mean 'N-BK7'"),
        ("N-SF11", 350.0, "undefined"),
        ("1.5/60", 900.0, "undefined"),
        (0.9, 550.0, "1 to 5"),
        ("1.5/abc", 550.0, "expected nd/Vd"),
        ("1.5/2", 550.0, "Abbe"),
        ("N-BK7", np.nan, "undefined at nan nm"),
        ("conrady:1.5,0.01@300-700", 550.0, "has 2 coefficients; expected n0, a, b"),
        ("schott:2.25@300-700", 550.0, "has 1 coefficients; expected at least a0 and a1"),
        ("sellmeier:1.0,0.006,0.2@300-700", 550.0, "expected pairs of B and C"),
        ("sellmeier:-0.9,0.006@300-700", 550.0, "refractive index 0.28.*expected 1 to 5"),
        ("schott:-2.0,0.0@300-700", 550.0, "refractive index nan"),
    ],
)
def test_what_is_undefined_is_refused(glass, wave, said):
    with pytest.raises(ValueError, match=said):
        index(glass, wave)
