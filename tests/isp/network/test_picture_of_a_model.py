"""With bilinear interpolation as its model, `isp=network` gives the pictures of the classical isps.

Tolerances allow for the rounding of float32: 6e-8 of the brightest sample, times a few for the sum
of nine samples.
"""

import numpy as np
import pytest
from isethdr_isp.develop import solve_matrix
from isethdr_isp.merge import charges
from isethdr_isp.spectra import light

import isethdr_core as hdr
from isethdr_core import ledger
from isethdr_core.conformance.isp import captures as mosaic_of_xyz
from isethdr_core.errors import UnitError
from isethdr_core.testing import check
from isethdr_core.truth import FIXED_PATTERN, total_variance, variance_known

FLOAT32 = 1e-6
ROOT = 1e-5  # the model takes noise as a square root and squares it: about ten roundings of float32
INNER = (slice(2, -2), slice(2, -2))  # at the border, mirrored samples count twice in the variance


def network(path, **fields):
    return hdr.build("isp", "network", model=str(path), **fields)


def unit_of(captures):
    """Return the electrons of green per cd/m2 of daylight."""
    nm = captures.wavelength.values
    groups, _ = charges(captures, "daylight")
    return groups[-1][0].response[1] @ light("daylight", nm)


def same(a, b, tolerance=FLOAT32):
    """Return whether two arrays agree within `tolerance` times the largest value."""
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


@pytest.mark.parametrize(
    "settings", [{}, {"falloff": "cos4"}, {"dark": 40.0, "step_e": 2.0}], ids=str
)
def test_bilinear_as_a_model_equals_linear(models, taken, tmp_path, settings):
    captures, matrix = taken(**settings)
    path = models.bilinear_model(tmp_path / "bilinear.onnx", matrix)
    mine = network(path)(captures)
    classical = hdr.build("isp", "linear")(captures)
    assert same(mine.xyz.values, classical.xyz.values)
    assert same(mine.variance.values[INNER], classical.variance.values[INNER], ROOT)
    assert np.array_equal(mine.valid.values, classical.valid.values)
    assert mine.attrs["white_xyz"] == classical.attrs["white_xyz"]


def test_several_captures_are_merged_before_a_model_of_one(models, taken, bench, tmp_path):
    captures, matrix = taken(specs=bench.SPLIT, top_e=2e5)
    path = models.bilinear_model(tmp_path / "bilinear.onnx", matrix)
    mine = network(path)(captures)
    classical = hdr.build("isp", "merge")(captures)
    assert same(mine.xyz.values, classical.xyz.values)
    # two merged charges have up to 1 % less variance than the shot noise of `raw`; the model adds
    # `noise` to that shot noise, so it cannot state less
    ratio = mine.variance.values[INNER] / classical.variance.values[INNER]
    assert 1 - ROOT < ratio.min() and ratio.max() < 1.011
    other = network(path, rule="average")(captures)
    assert not same(other.xyz.values, classical.xyz.values)


@pytest.mark.parametrize("shift", [(0, 0), (0, 1), (1, 0), (1, 1)], ids=str)
def test_a_shifted_array_is_padded_to_the_phase_of_the_model(models, taken, bench, tmp_path, shift):
    pattern = np.roll(bench.BAYER, shift, (0, 1))
    captures, matrix = taken(pattern=pattern)
    path = models.bilinear_model(tmp_path / "bilinear.onnx", matrix)
    mine = network(path)(captures)
    assert same(mine.xyz.values, hdr.build("isp", "linear")(captures).xyz.values)


def test_electrons_are_absolute(models, taken, tmp_path):
    captures, matrix = taken()
    path = models.bilinear_model(tmp_path / "bilinear.onnx", matrix)
    usual = network(path)(captures)
    black = captures["black_dn"]
    brighter = captures.assign(raw=black + 100 * (captures["raw"] - black), top_dn=1e12 + black)
    assert same(network(path)(brighter).xyz.values, 100 * usual.xyz.values)
    longer = captures.assign(exposure_s=2 * captures["exposure_s"])
    assert same(network(path)(longer).xyz.values, usual.xyz.values / 2)


def test_pixels_near_saturated_samples_are_not_valid(models, taken, tmp_path):
    captures, matrix = taken()
    saturated = captures["saturated"].copy()
    saturated[0, 10, 20] = True
    path = models.bilinear_model(tmp_path / "bilinear.onnx", matrix)
    picture = network(path)(captures.assign(saturated=saturated))
    wrong = np.argwhere(~picture.valid.values)
    assert [9, 19] == wrong.min(0).tolist() and [11, 21] == wrong.max(0).tolist()
    assert len(wrong) == 9 and np.isfinite(picture.xyz.values).all()


def test_every_capture_comes_in_electrons_of_the_most_sensitive_one(models, bench, tmp_path):
    names = [spec["name"] for spec in bench.SPLIT]
    contract = {**models.CONTRACT, "captures": names, "calibration": "unknown"}
    mean = np.geomspace(1.0, 2e5, 64 * 4).reshape(4, 64)
    captures = bench.make(mean, bench.SPLIT)
    e_per_cd_m2 = unit_of(captures)
    for plane, spec in enumerate(bench.SPLIT):
        seen = {}
        for name in ("raw", "noise", "valid"):
            path = models.one_plane(tmp_path / f"{name}{plane}.onnx", name, plane, 3, contract)
            seen[name] = network(path)(captures).xyz.values[..., 0] * e_per_cd_m2
        scale = 1 / spec.get("area", 1.0)  # electrons of the large photodiode per electron
        measured = mean / scale < spec["top_e"] - 5 * spec["read"]
        assert np.array_equal(seen["valid"] > 0.5, measured)
        assert np.allclose(seen["raw"][measured], mean[measured], rtol=FLOAT32)
        # `noise` holds the variance beyond the shot noise of `raw`: read noise, and the larger shot
        # noise of a small photodiode
        added = spec["read"] ** 2 * scale**2 + mean * (scale - 1)
        # 1e-5: the square root of a difference, rounded to float32
        assert np.allclose(seen["noise"][measured] ** 2, added[measured], rtol=1e-5)
        assert all(np.isfinite(values).all() for values in seen.values())


def test_the_stated_error_is_split_into_shots_and_devices(models, bench, tmp_path):
    """The model states the total variance of an unknown device. The fixed pattern has the same
    share of it as of the variance of the samples.
    """
    level = 2000.0
    prnu = 0.02
    captures = bench.make(np.full((48, 64), level), bench.ONE, rng=np.random.default_rng(3))
    path = models.bilinear_model(tmp_path / "model.onnx", np.eye(3))
    plain = network(path)(captures)
    uneven = network(path)(captures.assign(prnu=("capture", [prnu])))
    assert np.all(plain[FIXED_PATTERN].values == 0)
    assert same(total_variance(uneven).values, plain.variance.values)
    share = (uneven[FIXED_PATTERN] / total_variance(uneven)).values[INNER]
    fixed = (prnu * level) ** 2
    expected = fixed / (fixed + level + bench.ONE[0]["read"] ** 2)
    # 2.5 %: 5 standard errors of 0.5 %, for the square of means of 81 samples with a noise of 2.2 %
    assert np.allclose(share, expected, rtol=0.025)


def test_a_variance_counts_as_known_only_where_it_is_calibrated(models, taken, tmp_path):
    captures, matrix = taken()
    for number, (calibration, known) in enumerate(
        [
            ("unknown", False),
            ([{"lux": 1.0, "stated_over_true": 0.79}], False),
            ([{"lux": 0.1, "stated_over_true": 1.24}, {"lux": 1, "stated_over_true": 0.81}], True),
        ]
    ):
        contract = {**models.CONTRACT, "calibration": calibration}
        path = models.bilinear_model(tmp_path / f"{number}.onnx", matrix, contract=contract)
        rows = ledger.Ledger()
        with ledger.stage(rows, "isp network"):
            picture = network(path)(captures)
        assert variance_known(picture) == known
        assert np.isfinite(total_variance(picture).values).all() == known
        assert any(note.key == "variance" for note in rows[0].left_out) != known
        assert any(term.source.key == "variance" for term in rows[0].errors) == known


def test_a_model_that_returns_nan_is_named(models, taken, tmp_path):
    captures, matrix = taken()
    path = models.bilinear_model(tmp_path / "nan.onnx", matrix * np.nan)
    with pytest.raises(UnitError, match="nan.onnx returned xyz with 5661 of 5661 .*another model"):
        network(path)(captures)


def test_it_keeps_the_promises_of_an_isp(models, tmp_path):
    captures = mosaic_of_xyz()
    groups, _ = charges(captures, "daylight")
    [read] = groups[-1]
    matrix = solve_matrix(read.response, captures.wavelength.values, "daylight", np.inf)
    contract = {**models.CONTRACT, "cfa": "XY/YZ", "channels": ["X", "Y", "Z"], "unit_channel": "Y"}
    path = models.bilinear_model(
        tmp_path / "xyz.onnx", matrix * read.sensitivity[1], contract=contract
    )
    check("isp", "network", model=str(path))
