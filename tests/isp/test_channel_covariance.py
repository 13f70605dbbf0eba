"""The stated variance of XYZ after a demosaic includes the covariance between channels, and agrees
with noise realisations.
"""

import numpy as np
import pytest
from isethdr_isp import LinearIsp
from isethdr_isp.demosaic.methods import interpolate
from isethdr_isp.develop import solve_matrix
from isethdr_isp.readout.electrons import readouts
from isethdr_isp.readout.noise_propagation import independent
from isethdr_isp.spectra import light, radiances

SHAPE = (40, 48)
INNER = np.s_[6:-6, 6:-6]
READ_E = 2.0


def scene(bench, name, electrons):
    """Return the mean electrons (y, x) of a flat field, a slanted edge, a colour chart or coloured
    patches; the brightest pixel has `electrons`.
    """
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    filters = np.tile(bench.BAYER, (SHAPE[0] // 2, SHAPE[1] // 2))
    surfaces = (
        radiances(bench.WAVELENGTH)[:73]
        @ (bench.electrons_per_radiance() / bench.electrons_per_radiance().sum()).T
    )
    grey = surfaces[0]
    if name == "flat":
        planes = np.broadcast_to(grey[:, None, None], (3, *SHAPE))
    elif name == "edge":  # 10 : 1, slanted by 5 degrees, one pixel wide
        planes = grey[:, None, None] * (
            0.1 + 0.9 / (1 + np.exp(-4 * (x - 23.3 - np.tan(np.radians(5)) * y)))
        )
    elif name == "macbeth":  # the 24 surfaces of the chart by daylight, 8 x 10 pixels each
        response = bench.electrons_per_radiance() / bench.electrons_per_radiance().sum()
        patches = (macbeth(bench.WAVELENGTH) * light("daylight", bench.WAVELENGTH)) @ response.T
        planes = np.moveaxis(patches[y // 10 * 6 + x // 8], -1, 0)
    else:  # 12 patches of 12 x 14 pixels
        number = y // 14 * 4 + x // 12
        planes = (
            np.moveaxis(surfaces[5 * number + 1], -1, 0)
            * np.linspace(0.1, 1.0, 12)[(number * 5) % 12]
        )
    mean = np.take_along_axis(planes, filters[None], 0)[0]
    return mean * (electrons / mean.max())


def macbeth(wavelength_nm):
    """Return the reflectance (24, wavelength) of the ColorChecker, ISO 17321-1."""
    import colour

    chart = colour.SDS_COLOURCHECKERS["ISO 17321-1"].values()
    return np.array([np.interp(wavelength_nm, s.wavelengths, s.values) for s in chart])


def stated_over_true(bench, isp, name, electrons, realisations):
    """Return the ratio of the mean stated variance to that of the realisations, for X, Y and Z."""
    rng = np.random.default_rng(7)
    mean = scene(bench, name, electrons)
    shot = bench.make(mean, [{"name": "A", "charge": 0, "top_e": 1e9, "read": READ_E}])
    total = 0.0
    square = 0.0
    stated = 0.0
    for _ in range(realisations):
        charge = rng.poisson(mean) + READ_E * rng.standard_normal(SHAPE)
        picture = isp(shot.assign(raw=(shot["raw"].dims, (64.0 + 0.5 * charge)[None])))
        xyz = picture["xyz"].values[INNER]
        total = total + xyz
        square = square + xyz**2
        stated = stated + picture["variance"].values[INNER]
    true = (square - total**2 / realisations) / (realisations - 1)
    return (stated / realisations).mean((0, 1)) / true.mean((0, 1))


@pytest.mark.parametrize("method", ["bilinear", pytest.param("malvar", marks=pytest.mark.slow)])
def test_a_linear_demosaic_states_the_squares_of_its_answers(bench, method):
    """The variance is the sum over samples of the squared response to one sample, times the
    variance of the sample.
    """
    if method == "malvar":
        pytest.importorskip("colour_demosaicing")
    rng = np.random.default_rng(0)
    shape = (12, 14)
    names = list("RGB")
    filters = np.tile(bench.BAYER, (6, 7))
    variance = rng.uniform(1, 9, shape)
    [read] = readouts(bench.make(np.ones(shape)), light("daylight", bench.WAVELENGTH))
    matrix = solve_matrix(read.response, bench.WAVELENGTH, "daylight", 20.0)
    none = np.zeros(shape, bool)
    expected = 0.0
    for place in np.ndindex(shape):
        impulse = np.zeros(shape)
        impulse[place] = 1.0
        answer = np.tensordot(
            matrix, interpolate(method, impulse, filters, names, variance, none).planes, 1
        )
        expected = expected + answer**2 * variance[place]
    stated = interpolate(method, variance, filters, names, variance, none).noise_map.variance(
        matrix, independent(variance)
    )
    np.testing.assert_allclose(stated, expected, rtol=1e-9)  # float64 sums


@pytest.mark.slow
@pytest.mark.parametrize(
    "method, tolerance, name, electrons",
    [
        ("malvar", 0.03, "flat", 3.0),
        ("malvar", 0.03, "edge", 10000.0),
        ("bilinear", 0.03, "patches", 100.0),
        *(("malvar", 0.03, "macbeth", electrons) for electrons in (3.0, 100.0, 10000.0)),
    ],
)
def test_the_variance_of_xyz_is_that_of_the_realisations(bench, method, tolerance, name, electrons):
    if method == "malvar":
        pytest.importorskip("colour_demosaicing")
    found = stated_over_true(bench, LinearIsp(demosaic=method), name, electrons, 300)
    # 3 %: one standard error is sqrt(2 / 33 600) = 0.8 %, for 300 realisations of 1008 pixels, of
    # which 9 at a time share their error
    np.testing.assert_allclose(found, 1.0, atol=tolerance)
