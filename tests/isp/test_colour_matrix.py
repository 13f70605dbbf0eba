"""The colour matrix is a least-squares fit without noise, and has the least expected error with
noise, at the light level that the picture states.
"""

import numpy as np
import pytest
from isethdr_isp.develop import design_luminance, solve_matrix
from isethdr_isp.spectra import light, radiances

from isethdr_core.physics.photometry import xyz_weights


def setup(bench, filters="rgbw"):
    """Return the response, electrons and XYZ of the surfaces, and the white in electrons and
    XYZ.
    """
    response = bench.electrons_per_radiance(qe=bench.QE_W if filters == "rgbw" else bench.QE)
    samples = radiances(bench.WAVELENGTH)
    weights = xyz_weights(bench.WAVELENGTH)
    white = light("daylight", bench.WAVELENGTH)
    return response, samples @ response.T, samples @ weights.T, response @ white, weights @ white


@pytest.mark.parametrize("filters", ["bayer", "rgbw"])
def test_without_noise_it_is_least_squares_that_keep_the_white(bench, filters):
    response, electrons, target, white_e, white = setup(bench, filters)
    matrix = solve_matrix(response, bench.WAVELENGTH, "daylight", np.inf, 25.0)
    # independent computation: Lagrange's equations of the same problem, row by row
    gram = electrons.T @ electrons
    n = len(white_e)
    saddle = np.block([[gram, white_e[:, None]], [white_e[None], np.zeros((1, 1))]])
    expected = np.linalg.solve(saddle, np.vstack([electrons.T @ target, white[None]]))[:n].T
    # 1e-6: the normal equations of four similar channels lose ten digits
    np.testing.assert_allclose(matrix, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("snr, dark_var", [(20.0, 0.0), (5.0, 0.0), (5.0, 81.0), (1.0, 9.0)])
def test_with_noise_no_other_matrix_that_keeps_the_white_errs_less(bench, snr, dark_var):
    response, electrons, target, white_e, white = setup(bench)
    matrix = solve_matrix(response, bench.WAVELENGTH, "daylight", snr, dark_var)
    level = design_luminance(electrons.mean(), snr, dark_var)
    noise = np.diag(electrons.mean(0) * level + dark_var) / level**2

    def expected_error(m):
        return np.sum((electrons @ m.T - target) ** 2) + len(electrons) * np.trace(m @ noise @ m.T)

    np.testing.assert_allclose(matrix @ white_e, white, rtol=1e-9)
    rng = np.random.default_rng(0)
    least = expected_error(matrix)
    for _ in range(50):
        step = rng.standard_normal(matrix.shape) * np.abs(matrix).mean()
        step -= np.outer(step @ white_e, white_e) / (white_e @ white_e)  # keeps the white
        # a quadratic error has one minimum: every step away from it increases the error
        assert (
            expected_error(matrix + step) > least and expected_error(matrix - 1e-3 * step) > least
        )


@pytest.mark.parametrize("dark_var", [0.0, 4.0, 1e4])
def test_the_stated_light_level_has_the_stated_ratio(dark_var):
    electrons = 37.0 * design_luminance(37.0, 20.0, dark_var)
    assert electrons / np.sqrt(electrons + dark_var) == pytest.approx(20.0, rel=1e-12)
    assert design_luminance(37.0, np.inf, dark_var) == np.inf


def test_read_noise_counts_beside_shot_noise(bench):
    """With read noise, an SNR of 1 needs more light, and the noise depends less on the channel. The
    matrix then uses W more, and amplifies equal noise in all channels less.
    """
    response, *_ = setup(bench)
    quiet, noisy = (
        solve_matrix(response, bench.WAVELENGTH, "daylight", 1.0, v) for v in (0.0, 400.0)
    )
    # variance of XYZ for the same noise in every channel
    gain = [np.trace(m @ m.T) for m in (quiet, noisy)]
    assert gain[1] < gain[0]


def test_the_picture_says_the_level_the_matrix_is_made_for(bench):
    from isethdr_isp import LinearIsp

    response, electrons, *_ = setup(bench, "bayer")
    picture = LinearIsp(design_snr=10.0)(bench.make(np.full((12, 16), 50.0)))
    assert picture.attrs["design_cd_m2"] == pytest.approx(
        design_luminance(electrons.mean(), 10.0, 4.0), rel=1e-6
    )
