"""Transforms along one axis, with SciPy and with ducc0: against the sum that defines them, and
round trips.
"""

import numpy as np
import pytest

from isethdr_core.physics.convolution import fourier

rng = np.random.default_rng(0)
LIBRARIES = ["SciPy", "ducc0"]


@pytest.fixture(params=LIBRARIES)
def library(request, monkeypatch):
    if request.param == "SciPy":
        monkeypatch.setattr(fourier, "duccs", None)
    elif fourier.duccs is None:
        pytest.skip("ducc0 is not installed: pip install 'isethdr[fast]'")


def matrix(n):
    return np.exp(-2j * np.pi * np.outer(np.arange(n), np.arange(n)) / n)


# tolerances: rounding of n = 90 terms of size 1, a few times eps x sqrt(n)
@pytest.mark.parametrize(
    "real, made, tolerance", [(np.float64, np.complex128, 1e-13), (np.float32, np.complex64, 1e-4)]
)
def test_rows(library, real, made, tolerance):
    # the output is a part of a wider array
    rows = rng.uniform(-1, 1, (5, 90)).astype(real)
    out = np.empty((5, 60), made)[:, :46]
    fourier.rfft(rows, out)
    np.testing.assert_allclose(out, rows @ matrix(90)[:, :46], atol=tolerance)
    again = np.empty((5, 90), real)
    fourier.irfft(out, again)
    np.testing.assert_allclose(again, rows, atol=tolerance)


@pytest.mark.parametrize("made, tolerance", [(np.complex128, 1e-13), (np.complex64, 1e-4)])
def test_columns(library, made, tolerance):
    columns = (rng.uniform(-1, 1, (90, 7)) + 1j * rng.uniform(-1, 1, (90, 7))).astype(made)
    there = fourier.fft(columns.copy())
    assert there.dtype == made
    np.testing.assert_allclose(there, matrix(90) @ columns, atol=tolerance)
    np.testing.assert_allclose(fourier.ifft(there.copy()), columns, atol=tolerance)


@pytest.mark.parametrize("made, tolerance", [(np.complex128, 1e-13), (np.complex64, 1e-4)])
def test_rows_of_complex_values_and_hermitian_columns(library, made, tolerance):
    rows = (rng.uniform(-1, 1, (5, 90)) + 1j * rng.uniform(-1, 1, (5, 90))).astype(made)
    np.testing.assert_allclose(fourier.fft_rows(rows.copy()), rows @ matrix(90), atol=tolerance)
    half = rows[:, :46].T.copy()
    half[0], half[45] = half[0].real, half[45].real
    whole = np.concatenate([half, half[44:0:-1].conj()])
    found = fourier.hermitian(half, 90)
    np.testing.assert_allclose(found, (matrix(90) @ whole).real, atol=tolerance)
