"""Haze: the stated share over the hemisphere, closed forms, wavelength laws, limits, energy in a
picture.
"""

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens
from isethdr_optics.flare.haze import HazeFlare, _hemisphere
from isethdr_optics.psf.scatter import total

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.testing import check

FORMS = ("harvey_shack", "abg")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "shoulder_deg, slope", [(0.01, 2.0), (0.5, 1.0), (2.0, 2.5), (30.0, 4.0), (1.0, 0.0)]
)
def test_the_hemisphere_holds_the_stated_share(form, shoulder_deg, slope):
    from scipy.integrate import quad

    flare = HazeFlare(form, 0.1, shoulder_deg, slope)
    # adaptive quadrature over decades of angle: independent of the nodes that scale the function
    found = quad(
        lambda u: flare.scatter(550.0, np.exp(u)) * 2 * np.pi * np.sin(np.exp(u)) * np.exp(u),
        np.log(1e-9),
        np.log(np.pi / 2),
        epsabs=1e-12,
        epsrel=1e-10,
        limit=400,
    )[0]
    assert found == pytest.approx(0.1, abs=1e-6)
    # the share that the kernel removes from the sharp image
    assert total(flare, 550.0) == pytest.approx(0.1, abs=1e-6)
    assert flare.scatter(550.0, np.linspace(0, np.pi / 2, 999)).min() >= 0


@pytest.mark.parametrize("shoulder, slope", [(0.01, 2.0), (0.003, 1.5), (0.4, 3.0)])
def test_closed_form_of_harvey_shack(shoulder, slope):
    t = 1 / shoulder**2
    want = (
        np.pi
        * shoulder**2
        * (np.log1p(t) if slope == 2 else ((1 + t) ** (1 - slope / 2) - 1) / (1 - slope / 2))
    )
    # error of 1600 Gauss nodes
    assert _hemisphere("harvey_shack", shoulder, slope) == pytest.approx(want, rel=1e-9)


def test_closed_form_of_abg():
    want = np.pi * 0.02**2 * np.log1p(1 / 0.02**2)  # both forms are equal at slope 2
    assert _hemisphere("abg", 0.02, 2.0) == pytest.approx(want, rel=1e-9)
    assert _hemisphere("abg", 0.02, 1.0) == pytest.approx(
        2 * np.pi * 0.02 * (1 - 0.02 * np.log1p(1 / 0.02)), rel=1e-9
    )


@pytest.mark.parametrize("form", FORMS)
def test_shoulder_and_slope(form):
    flare = HazeFlare(form, shoulder_deg=0.5, slope=2.4)
    at = np.radians(0.5)
    half = 0.5 if form == "abg" else 2**-1.2
    # the cosine of half a degree is 1 - 4e-5
    assert flare.scatter(550.0, at) / flare.scatter(550.0, 0.0) == pytest.approx(half, rel=1e-4)
    far = np.radians([15.0, 20.0])
    btdf = flare.scatter(550.0, far) / np.cos(far)
    # error of the power law at large angles: (shoulder / sin(angle))^2
    assert np.diff(np.log(btdf))[0] / np.diff(np.log(np.sin(far)))[0] == pytest.approx(
        -2.4, abs=5e-3
    )


def test_wavelength_laws():
    flare = HazeFlare(scattered=0.3)
    # the optical depth is exactly a power of wavelength; so is the scattered light where it is weak
    assert np.log1p(-flare.total(440.0)) / np.log1p(-flare.total(880.0)) == pytest.approx(
        4.0, rel=1e-12
    )
    weak = HazeFlare(scattered=1e-5)
    # 1 - exp(-x) = x to a relative error of x / 2
    assert weak.total(440.0) / weak.total(880.0) == pytest.approx(4.0, rel=1e-4)
    # Weak scatter of a rough surface is a function of sin(angle) / wavelength, and its peak goes as
    # wavelength^-4 (Rayleigh-Rice), for slopes above 2.
    steep = HazeFlare(scattered=1e-5, slope=4.0, shoulder_deg=0.1)
    # 1e-3: the share of the function beyond 90 degrees
    assert steep.scatter(440.0, 0.0) / steep.scatter(880.0, 0.0) == pytest.approx(16.0, rel=1e-3)
    grey = HazeFlare(wavelength_exponent=0.0, shoulder_exponent=0.0)
    angle = np.linspace(0, 1, 50)
    np.testing.assert_array_equal(grey.scatter(440.0, angle), grey.scatter(880.0, angle))


def scene(n=121, pitch_um=12.0, lamp=1e6):
    x = quantities.centres(n, n * pitch_um * 1e-3 / 4.0)
    values = np.zeros((1, n, n))
    values[0, n // 2, n // 2] = lamp
    return quantities.plane(values, [550.0], x, x, quantities.RADIANCE)


def test_nothing_scattered_changes_nothing():
    for lens in (DiffractionLimitedLens(falloff="none"), IdealLens(falloff="none")):
        np.testing.assert_array_equal(lens(scene(31), [HazeFlare(scattered=0.0)]), lens(scene(31)))


def test_the_point_spread_of_a_lens_without_blur_has_the_haze_of_its_image():
    flare = HazeFlare(scattered=0.2, shoulder_deg=0.5, slope=4.0)
    lens = IdealLens(falloff="none", focal_length_mm=4.0)
    image = lens(scene(31, lamp=1.0), [flare]).values / lens.throughput_sr()
    psf = lens.psf([550.0], 12.0, 31, {"veil": flare}).values
    np.testing.assert_allclose(psf, image, rtol=1e-5)


def test_a_picture_keeps_its_energy():
    # With slope 4 and a shoulder of 0.5 degrees, 0.3 % of the haze lies beyond the frame, 10
    # degrees away (closed form of a disc).
    lens = IdealLens(falloff="none")
    flare = HazeFlare(scattered=0.1, shoulder_deg=0.5, slope=4.0)
    clean = lens(scene())
    hazy = lens(scene(), [flare])
    assert hazy.values.min() >= 0
    assert float(hazy.sum()) == pytest.approx(float(clean.sum()), rel=5e-4)
    ratio = float(hazy[0, 60, 60]) / float(clean[0, 60, 60])
    # The lamp's tile keeps 0.9 and the haze within half a tile: 1.5 mrad, with a shoulder of 8.7
    # mrad.
    within = 1 - 1 / (1 + (4 / np.pi) * (1.5 / 8.7) ** 2)
    assert ratio == pytest.approx(0.9 + 0.1 * within, abs=5e-4)


def test_two_hazes_take_turns():
    a = HazeFlare(scattered=0.1, slope=4.0)
    b = HazeFlare("abg", 0.2, slope=4.0)
    lens = IdealLens(falloff="none")
    out = lens(scene(), [a, b])
    np.testing.assert_allclose(out[0, 60, 60] > 0.72 * lens(scene())[0, 60, 60], True)
    assert float(out.sum()) <= float(lens(scene()).sum()) * (1 + 1e-6)


@pytest.mark.slow  # the test of all components checks the other form
def test_promises():
    check("flare", "haze", form="abg", scattered=0.2, slope=1.5)


@pytest.mark.parametrize(
    "bad",
    [
        {"scattered": 1.0},
        {"scattered": -0.1},
        {"shoulder_deg": 0.0},
        {"slope": -1.0},
        {"form": "x"},
    ],
)
def test_mistakes_are_told(bad):
    with pytest.raises(ConfigError, match="expected .*; type "):
        HazeFlare(**bad)
