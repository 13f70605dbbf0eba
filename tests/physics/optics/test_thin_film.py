"""Thin films: energy, Fresnel's limit, Brewster's angle, quarter waves, reversal, absorption."""

import numpy as np
import pytest

from isethdr_core.physics.optics.thin_film import quarter_wave_nm, reflect, reflect_unpolarised

COS = np.cos(np.radians(np.linspace(0, 89.9, 60)))
THREE = [(1.38, 99.6), (2.05, 134.1), (1.70, 80.9)]


def fresnel(n1, n2, cos1):
    """Return Fresnel's R_s and R_p by the textbook formulas, without matrices."""
    cos2 = np.sqrt(1 - (n1 / n2) ** 2 * (1 - cos1**2) + 0j)
    r_s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2)
    r_p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2)
    return abs(r_s) ** 2, abs(r_p) ** 2


def test_no_layer_is_fresnel():
    for n1, n2 in ((1.0, 1.52), (1.52, 1.0), (1.7, 1.33)):
        r_s, r_p, t_s, t_p = reflect(n1, n2, [], COS, 550.0)
        want = fresnel(n1, n2, COS)
        np.testing.assert_allclose(r_s, want[0], rtol=1e-10)
        # 1e-8: cancellation near Brewster's angle
        np.testing.assert_allclose(r_p, want[1], rtol=1e-8, atol=1e-14)
        np.testing.assert_allclose([r_s + t_s, r_p + t_p], 1.0, rtol=1e-12)


def test_hand_values_at_normal_incidence():
    # uncoated glass: 4.26 %
    assert reflect(1.0, 1.52, [], 1.0, 550.0)[0] == pytest.approx((0.52 / 2.52) ** 2, rel=1e-12)
    layer = [(1.38, quarter_wave_nm(1.38, 550.0))]
    # a quarter wave: ((n0 ns - n1^2) / (n0 ns + n1^2))^2
    want = ((1.52 - 1.38**2) / (1.52 + 1.38**2)) ** 2
    assert want == pytest.approx(0.0126, abs=5e-5)
    assert reflect(1.0, 1.52, layer, 1.0, 550.0)[0] == pytest.approx(want, rel=1e-10)
    half = [(1.38, quarter_wave_nm(1.38, 550.0, 2))]  # a half wave has no effect
    assert reflect(1.0, 1.52, half, 1.0, 550.0)[0] == pytest.approx((0.52 / 2.52) ** 2, rel=1e-10)
    # an index of sqrt(n0 ns): nothing is reflected
    perfect = [(np.sqrt(1.52), quarter_wave_nm(np.sqrt(1.52), 550.0))]
    assert reflect(1.0, 1.52, perfect, 1.0, 550.0)[0] < 1e-20


def test_brewster_and_normal_incidence_of_both_polarisations():
    brewster = np.cos(np.arctan(1.52))
    assert reflect(1.0, 1.52, [], brewster, 550.0)[1] < 1e-30
    r_s, r_p, *_ = reflect(1.0, 1.52, THREE, 1.0, 480.0)
    assert r_s == pytest.approx(r_p, rel=1e-12)


def test_lossless_stacks_conserve_energy_and_reverse():
    wave = np.linspace(380, 780, 9)[:, None]
    r_s, r_p, t_s, t_p = reflect(1.0, 1.62, THREE, COS[None], wave)
    np.testing.assert_allclose([r_s + t_s, r_p + t_p], 1.0, rtol=1e-11)
    # from behind, at the refracted angle, the same fraction is transmitted (Stokes, reciprocity)
    cos_back = np.sqrt(1 - (1 / 1.62) ** 2 * (1 - COS**2))
    back = reflect(1.62, 1.0, THREE[::-1], cos_back[None], wave)
    np.testing.assert_allclose(back[2], t_s, rtol=1e-8)  # the angle goes through two square roots
    np.testing.assert_allclose(back[3], t_p, rtol=1e-8)


def test_total_and_frustrated_total_reflection():
    beyond = np.cos(np.radians(60.0))
    r_s, r_p, t_s, t_p = reflect(1.52, 1.0, [], beyond, 550.0)
    np.testing.assert_allclose([r_s, r_p], 1.0, rtol=1e-12)
    assert t_s == t_p == 0
    # an air gap between two glasses transmits all light where it is closed and none where it is
    # wide, and is monotonic in between
    gaps = [
        reflect(1.52, 1.52, [(1.0, d)], beyond, 550.0)[2] for d in (0.0, 50.0, 150.0, 500.0, 5000.0)
    ]
    assert gaps[0] == pytest.approx(1, rel=1e-12) and np.all(np.diff(gaps) < 0) and gaps[-1] < 1e-9


def test_absorbing_layers_lose_and_never_gain():
    r, t = reflect_unpolarised(1.0, 1.52, [(2.0 - 0.5j, 100.0)], COS, 550.0)
    assert np.all(r + t < 1) and np.all(t >= 0)
    bulk = reflect(1.0, 2.0 - 0.5j, [], 1.0, 550.0)[0]
    assert bulk == pytest.approx(abs((1 - (2 - 0.5j)) / (1 + (2 - 0.5j))) ** 2, rel=1e-12)
    thick = reflect(1.0, 1.52, [(2.0 - 0.5j, 5000.0)], 1.0, 550.0)
    assert thick[0] == pytest.approx(bulk, rel=1e-10) and thick[2] < 1e-20
    for count in (1, 4):  # the matrix of one layer would overflow, and the product of several
        opaque = reflect(1.0, 1.52, [(2.0 - 0.5j, 1e6)] * count, 1.0, 550.0)
        assert opaque[0] == pytest.approx(bulk, rel=1e-10) and 0 <= opaque[2] < 1e-200


def test_a_coating_shifts_to_the_blue_with_angle():
    wave = np.arange(400.0, 800.0, 1.0)
    layer = [(1.38, quarter_wave_nm(1.38, 600.0))]
    lowest = [
        wave[np.argmin(reflect(1.0, 1.52, layer, np.cos(np.radians(a)), wave)[0])] for a in (0, 45)
    ]
    # the optical thickness is n d cos(angle inside the layer)
    assert lowest[1] / lowest[0] == pytest.approx(np.sqrt(1 - 0.5 / 1.38**2), abs=0.01)


def test_bad_input():
    with pytest.raises(ValueError, match="cosine"):
        reflect(1.0, 1.5, [], -0.1, 550.0)
    with pytest.raises(ValueError, match="negative thickness"):
        reflect(1.0, 1.5, [(1.38, -1.0)], 1.0, 550.0)
    assert reflect(1.0, 1.5, [], 0.0, 550.0)[0] == pytest.approx(1, abs=1e-9)  # grazing
