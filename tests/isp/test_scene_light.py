"""Automatic white balance estimates the light from the shot; the colour matrix follows it."""

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.develop import solve_matrix
from isethdr_isp.readout.electrons import readouts
from isethdr_isp.scene_light import REFERENCE, channel_means, illuminant, nearest_mixture
from isethdr_isp.spectra import LIGHTS, Mixture, light, radiances

from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import xyz, xyz_weights
from isethdr_core.physics.radiometry import planck_radiance
from isethdr_core.plugins.registry import build

SHAPE = (12, 16)
MIXTURES = [
    *(Mixture(name, name, 0.0) for name in LIGHTS),
    Mixture("daylight", "halogen", 0.37),
    Mixture("halogen", "sodium", 0.6),
    Mixture("led", "sodium", 0.25),
    Mixture("incandescent", "incandescent", 0.0),
]


def array(bench, filters):
    return (bench.BAYER, bench.QE) if filters == "bayer" else (bench.RGBW, bench.QE_W)


@pytest.mark.parametrize("mixed", MIXTURES, ids=str)
@pytest.mark.parametrize("filters", ["bayer", "rgbw"])
def test_a_grey_in_any_mixture_keeps_its_colour(bench, mixed, filters):
    pattern, qe = array(bench, filters)
    grey = 7.0 * light(mixed, bench.WAVELENGTH)
    mosaic = bench.mosaic_of(grey, SHAPE, pattern, qe)
    picture = MergeIsp(balance="automatic")(bench.make(mosaic, pattern=pattern, qe=qe))
    # Mixtures are tried in steps of 1 %; three channels distinguish all of them.
    np.testing.assert_allclose(picture.xyz.values[5, 5], xyz(grey, bench.WAVELENGTH), rtol=1e-9)
    white = np.array(picture.attrs["white_xyz"])
    np.testing.assert_allclose(7 * white, picture.xyz.values[5, 5], rtol=1e-9)


def test_all_captures_of_a_split_pixel_count(bench):
    """The scene has steps of one cell each, from darkness to beyond the range of the large
    photodiode, with noise.
    """
    mixed = Mixture("daylight", "halogen", 0.5)
    grey = light(mixed, bench.WAVELENGTH)
    mosaic = bench.mosaic_of(grey, (64, 64)) * np.repeat(np.geomspace(0.3, 3e5, 32), 2)
    captures = bench.make(mosaic, bench.SPLIT, rng=np.random.default_rng(3))
    found = illuminant(captures, "automatic")
    assert (found.first, found.second) == ("daylight", "halogen")
    # The brightest tenth of the pixels decides. 1e6 e, seen by photodiodes of 1/100 of the area,
    # give an SNR of 100 per pixel, so 1e-3 per channel. Red over blue changes by 0.5 as the share
    # goes from 0 to 1.
    assert found.share == pytest.approx(0.5, abs=0.02)


def test_lamps_do_not_count(bench):
    wall = light("halogen", bench.WAVELENGTH)
    lamp = light("sodium", bench.WAVELENGTH)
    mosaic = bench.mosaic_of(wall, (40, 40))
    mosaic[8:12, 8:12] = 200 * bench.mosaic_of(lamp, (4, 4))
    assert str(illuminant(bench.make(mosaic), "automatic")) == "halogen"


def test_the_matrix_is_the_best_one_in_that_light(bench):
    """For surfaces in halogen light, the matrix for halogen light alone has 0.56 of the squared
    error of matrices for all lights, and no named balance has a smaller error.
    """
    response = bench.electrons_per_radiance()
    samples = radiances(bench.WAVELENGTH, ("halogen",))
    target = samples @ xyz_weights(bench.WAVELENGTH).T

    def error(balance):
        matrix = solve_matrix(response, bench.WAVELENGTH, balance, np.inf)
        return np.sum((samples @ response.T @ matrix.T - target) ** 2)

    found = Mixture("halogen", "halogen", 0.0)
    assert error(found) < 0.6 * min(error("daylight"), error("halogen"))
    assert error(found) < min(error(name) for name in LIGHTS)


# kinds of filters by their letters; the yellow and clear ones have no green of their own
CURVES = {"R": 0, "G": 1, "B": 2}


def of_letters(bench, cfa):
    """Return pattern (2, 2) and quantum efficiencies of a filter array of the letters R, G, B, Y
    (red and green), W and C (all).
    """
    curves = {letter: bench.QE[i] for letter, i in CURVES.items()}
    curves |= {"Y": bench.QE[0] + bench.QE[1], "W": bench.QE_W[3], "C": bench.QE_W[3]}
    letters = sorted(set(cfa))
    pattern = np.array([letters.index(letter) for letter in cfa]).reshape(2, 2)
    return pattern, np.stack([curves[letter] for letter in letters])


@pytest.mark.parametrize("cfa", ["RGGB", "RYYB", "RGWB"])
def test_a_grey_in_tungsten_light_is_not_taken_for_sodium(bench, cfa):
    """CIE illuminant A is a black body of 2856 K. The imitation by halogen and sodium has 2 to 12 %
    too much luminance.
    """
    pattern, qe = of_letters(bench, cfa)
    grey = planck_radiance(bench.WAVELENGTH, 2856.0)
    grey *= 50 / xyz(grey, bench.WAVELENGTH)[1]
    captures = bench.make(bench.mosaic_of(grey, SHAPE, pattern, qe), pattern=pattern, qe=qe)
    picture = MergeIsp(balance="automatic")(captures)
    np.testing.assert_allclose(picture.xyz.values[5, 5], xyz(grey, bench.WAVELENGTH), rtol=1e-6)
    assert picture.attrs["scene_light"] == "incandescent"


def share_of_tungsten(bench, cfa, grey, error=0.002):
    """Return how often tungsten is found in 100 estimates, 0 to 1. The channel means of `grey` have
    this relative error, as those of a scene that is not grey on average.
    """
    pattern, qe = of_letters(bench, cfa)
    captures = bench.make(bench.mosaic_of(grey, SHAPE, pattern, qe), pattern=pattern, qe=qe)
    reads = readouts(captures, light(REFERENCE, bench.WAVELENGTH))
    means = channel_means(reads, captures["filter"].values, captures.sizes["channel"])
    rng = np.random.default_rng(0)
    drawn = means * np.exp(error * rng.normal(size=(100, len(means))))
    found = [str(nearest_mixture(one, reads[0], bench.WAVELENGTH)[0]) for one in drawn]
    return np.mean(["incandescent" in name for name in found])


@pytest.mark.parametrize("cfa", ["RGGB", "RYYB", "RGWB", "RCCC"])
@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.75, 0.9])
def test_halogen_with_sodium_is_not_taken_for_tungsten(bench, cfa, share):
    """Without a margin, errors of 0.2 % would give tungsten in up to a third of the estimates."""
    grey = light(Mixture("halogen", "sodium", share), bench.WAVELENGTH)
    assert share_of_tungsten(bench, cfa, 50 * grey) == 0.0


def test_tungsten_is_found_with_errors_if_red_and_green_are_separate(bench):
    """RYYB has no green of its own, so small errors hide the tungsten."""
    grey = planck_radiance(bench.WAVELENGTH, 2856.0)
    grey *= 50 / xyz(grey, bench.WAVELENGTH)[1]
    for cfa in ("RGGB", "RGWB"):
        assert share_of_tungsten(bench, cfa, grey) == 1.0
    assert 0.3 < share_of_tungsten(bench, "RYYB", grey) < 0.9


def test_one_channel_and_darkness_are_taken_for_daylight(bench):
    one = bench.make(np.full(SHAPE, 50.0), pattern=np.array([[0]]), qe=bench.QE[1:2])
    dark = bench.make(np.zeros(SHAPE))
    for captures in (one, dark):
        found, named = (LinearIsp(balance=b)(captures) for b in ("automatic", "daylight"))
        np.testing.assert_array_equal(found.xyz.values, named.xyz.values)


def test_an_unknown_light_is_refused():
    with pytest.raises(ConfigError, match="did you mean 'automatic'"):
        build("isp", "merge", balance="automatik")
    with pytest.raises(ConfigError, match="balance is 'incandescent'"):  # for estimates alone
        build("isp", "merge", balance="incandescent")
