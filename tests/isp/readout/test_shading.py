"""Shading is stated by the lens or measured on a flat field; both give the same picture."""

import numpy as np
import pytest
from isethdr_isp import LinearIsp
from isethdr_isp.readout.shading import measured_shading, read_shading, shading, write_shading
from isethdr_isp.spectra import light

from isethdr_core.errors import ConfigError, UnitError

SHAPE = (60, 80)
FOCAL_MM = 0.25  # the corner of this small chip is 31 degrees off the axis


def flat(bench, level=1000.0, rng=None, stated="cos4"):
    grey = level * light("daylight", bench.WAVELENGTH)
    return bench.make(
        bench.mosaic_of(grey, SHAPE, falloff="cos4", focal=FOCAL_MM),
        falloff=stated,
        focal=FOCAL_MM,
        rng=rng,
    )


def test_a_measured_table_is_the_lens_law(bench):
    radius, relative, error = measured_shading(flat(bench, stated="none"))
    cos4 = (1 + (radius / FOCAL_MM) ** 2) ** -2
    assert relative[0] == 1 and radius[-1] == pytest.approx(
        1e3 * np.hypot(*(3e-6 * (n - 1) / 2 for n in SHAPE)), rel=1e-6
    )
    # a polynomial of four even powers follows cos^4 up to 31 degrees to 1e-4
    np.testing.assert_allclose(relative, cos4, atol=1e-3)


def test_noise_scatters_it_by_the_stated_error(bench):
    rng = np.random.default_rng(0)
    tables = [measured_shading(flat(bench, 300.0, rng, "none")) for _ in range(60)]
    curves = np.array([t[1] for t in tables])
    error = np.mean([t[2] for t in tables], 0)
    # 35 %: 60 realisations give a standard deviation to 9 %
    np.testing.assert_allclose(curves.std(0)[1:] / error[1:], 1, atol=0.35)
    exact = measured_shading(flat(bench, stated="none"))[1]
    assert np.all(np.abs(curves.mean(0) - exact)[1:] < 4 * error[1:] / np.sqrt(60))


def test_a_picture_made_with_the_table_is_flat_and_its_variance_grows_with_the_correction(
    bench, tmp_path
):
    path = tmp_path / "shading.csv"
    write_shading(path, *measured_shading(flat(bench, stated="none"))[:2])
    by_table = LinearIsp(shading_csv=str(path))(flat(bench, stated="none"))
    by_lens = LinearIsp()(flat(bench))
    np.testing.assert_allclose(by_table.xyz.values[..., 1], 1000.0, rtol=2e-3)
    np.testing.assert_allclose(by_table.variance.values, by_lens.variance.values, rtol=5e-3)
    fall = shading(flat(bench))
    corner, centre = (by_lens.variance.values[y, x, 1] for y, x in ((2, 2), (30, 40)))
    # fall x N electrons have a shot noise variance of fall x N, and are divided by fall, so the
    # variance is proportional to 1 / fall if read noise is small. Both pixels are red, and no
    # mirrored sample enters them
    assert corner / centre == pytest.approx(fall[30, 40] / fall[2, 2], rel=0.05)


def test_tables_come_back_and_bad_ones_are_named(bench, tmp_path):
    path = tmp_path / "a.csv"
    write_shading(path, [0.0, 0.1], [1.0, 0.5])
    np.testing.assert_array_equal(read_shading(path), [[0.0, 0.1], [1.0, 0.5]])
    assert (
        LinearIsp(shading_csv=str(path)).input_files() == (str(path),)
        and LinearIsp().input_files() == ()
    )
    with pytest.raises(UnitError, match="ends at 0.1 mm; expected up to 0.14"):
        LinearIsp(shading_csv=str(path))(flat(bench))
    for text, said in (
        ("radius_mm,relative_illumination\n0,1\n0,2\n", "with rising radius_mm"),
        ("radius_mm,relative_illumination\n0,1\n1,-2\n", "relative_illumination above 0"),
        ("radius_mm,relative_illumination\n0,1\n", "expected two or more lines"),
        ("x,y\n0,1\n1,1\n", "columns x, y; expected a first line radius_mm,relative_illumination"),
        ("radius_mm,relative_illumination\n0,one\n", "'one' in line 2, which is no number"),
        ("radius_mm,relative_illumination\n0\n1\n", "1 values in line 2; expected 2"),
        ("radius_mm,relative_illumination\n0,1\nnan,0.9\n2,0.8\n", "finite numbers"),
        ("radius_mm,relative_illumination\n0,1\n1,inf\n", "finite numbers"),
        ("radius_mm,relative_illumination\n", "holds no numbers"),
        ("radius_mm;relative_illumination\n0;1\n1;0,9\n", "semicolons .*expected commas.*type"),
        ("radius_mm,radius_mm\n0,1\n1,2\n", "2 columns radius_mm; expected each name once"),
        ("", "is empty; expected a first line radius_mm,relative_illumination"),
    ):
        path.write_text(text)
        with pytest.raises(ConfigError, match=said) as caught:
            read_shading(path)
        assert str(caught.value).startswith(f"isp.shading_csv={str(path)!r} ")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_shading(tmp_path / "none.csv")


def test_a_byte_order_mark_is_no_part_of_the_first_column(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbfradius_mm,relative_illumination\r\n0,1\r\n0.1,0.5\r\n")
    np.testing.assert_array_equal(read_shading(path), [[0.0, 0.1], [1.0, 0.5]])


def test_flat_fields_that_tell_nothing_are_refused(bench):
    with pytest.raises(UnitError, match="expected 2 % or better; expose more"):
        measured_shading(flat(bench, 0.5, np.random.default_rng(1), "none"))
    bright = flat(bench, stated="none")
    bright["saturated"][0, 3, 3] = True
    with pytest.raises(UnitError, match="is saturated; expected none; expose less"):
        measured_shading(bright)
    with pytest.raises(UnitError, match="dark on the axis"):
        measured_shading(flat(bench, 0.0, stated="none"))
