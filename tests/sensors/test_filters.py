"""Filter patterns and spectral curves."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from isethdr_sensors import BayerSensor, IdealSensor, RgbwSensor
from isethdr_sensors.spectral.colour_filter_array import cell, channels, filter_map
from isethdr_sensors.spectral.quantum_efficiency import (
    line_error,
    quantum_efficiency,
    smooth_spectrum_error,
    spectral_curve,
)
from isethdr_sensors.spectral.spectral_curves import filter_curve, infrared_cut
from numpy.testing import assert_allclose, assert_array_equal

from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger, stage
from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import photons_from_energy, planck_radiance
from isethdr_core.uncertainty.error_terms import Quantity


@pytest.mark.parametrize(
    "pattern, rows",
    [
        ("RGGB", ("RG", "GB")),
        ("RG/WB", ("RG", "WB")),
        ("W", ("W",)),
        ("RGB", None),
        ("RGB/RGB", ("RGB", "RGB")),
        ("RG", None),
        ("RG/W", None),
        ("", None),
        ("R//B", None),
    ],
)
def test_pattern_text(pattern, rows):
    if rows is None:
        with pytest.raises(ConfigError, match="rows parted by /"):
            cell(pattern)
    else:
        assert cell(pattern) == rows


def test_pattern_repeats_from_the_upper_left():
    assert (
        channels("GRBG") == ("R", "G", "B")
        and channels("RG/WB") == ("R", "G", "B", "W")
        and channels("RCCC") == ("R", "C")
    )
    assert_array_equal(
        filter_map("GRBG", 3, 5), [[1, 0, 1, 0, 1], [2, 1, 2, 1, 2], [1, 0, 1, 0, 1]]
    )
    assert_array_equal(filter_map("RG/WB", 2, 2), [[0, 1], [3, 2]])


def reference(name):
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set")
    return np.load(Path(folder) / "spectra" / name)


@pytest.mark.parametrize(
    "letter, rms, largest",
    [("R", 0.008, 0.024), ("G", 0.006, 0.015), ("B", 0.007, 0.040), ("W", 0.006, 0.018)],
)
def test_fit_residual_is_as_stated(letter, rms, largest):
    # the bounds are the residuals stated in spectral_curves, rounded up
    data = reference("sensor_qe.npz")
    error = (
        filter_curve(letter, data["wavelength_nm"]) - data["ar0132at_rgbw"][:, "RGBW".index(letter)]
    )
    assert np.sqrt(np.mean(error**2)) < rms and np.abs(error).max() < largest


def test_infrared_cut_residual_is_as_stated():
    data = reference("sensor_qe.npz")
    error = infrared_cut(data["wavelength_nm"]) - data["ircut_public"][:, 0]
    assert np.sqrt(np.mean(error**2)) < 0.020 and np.abs(error).max() < 0.052


def test_imx363_curves_are_the_same_shapes_times_062():
    data = reference("sensor_qe.npz")
    # 0.017: one of the two tables was resampled from a coarser grid
    assert_allclose(data["imx363_public"], 0.62 * data["ar0132at_rgb"], atol=0.017)


def test_responsivity_of_the_data_sheet():
    # 5.48 V/lux-s at 110 uV/e, under illuminant A (2856 K), without blocking filter, in green
    # pixels: peak_qe = 0.65 was derived under these assumptions
    w = np.arange(380.0, 781, 5)
    light = planck_radiance(w, 2856)
    photons = photons_from_energy(light, w) * 5 / luminance(light, w)
    qe = quantum_efficiency(BayerSensor(infrared_cut=False).model(), w)[1]
    volts = (photons * qe).sum() * 3.75e-6**2 * 110e-6
    # 3 %: peak_qe is stated to two digits, and the fit is good to 1 %
    assert_allclose(volts, 5.48, rtol=0.03)


def test_curves_are_physical_everywhere():
    w = np.linspace(200, 1200, 2001)
    for letter in "RGBWCYM":
        assert np.all((filter_curve(letter, w) >= 0) & (filter_curve(letter, w) <= 1))
    assert np.all((infrared_cut(w) >= 0) & (infrared_cut(w) <= 1))
    assert infrared_cut(850.0) < 1e-10
    # the centroid wavelength is shortest for the blue filter and longest for the red one
    centroid = [
        np.sum(w * filter_curve(k, w) * infrared_cut(w))
        / np.sum(filter_curve(k, w) * infrared_cut(w))
        for k in "BGR"
    ]
    assert centroid[0] < 480 < 520 < centroid[1] < 560 < 590 < centroid[2]


def test_clear_filter_gathers_more_than_any_colour():
    qe = quantum_efficiency(RgbwSensor().model(), np.arange(400.0, 701, 10)).sum(1)
    assert qe[3] > 1.8 * qe[:3].max()


def test_own_curves(tmp_path, flat):
    path = tmp_path / "qe.csv"
    # a column without a name is left out
    path.write_text("wavelength_nm,R,G,B,\n400,0,0,1,7\n500,0,1,0\n600,1,0,0\n601,0,0,0\n")
    sensor = IdealSensor(qe_csv=str(path), infrared_cut=False)
    # the table may end where the filter is blind
    assert_allclose(
        spectral_curve(sensor.model(), [450.0, 500.0, 700.0]), [[0, 0, 0], [0.5, 1, 0], [0.5, 0, 0]]
    )
    assert float(sensor.expected(flat(1e-3)).min()) > 0
    with pytest.raises(ConfigError, match="no column for filter 'W'"):
        RgbwSensor(qe_csv=str(path)).expected(flat(1e-3))


def test_a_changed_file_of_curves_is_read_again(tmp_path):
    path = tmp_path / "qe.csv"
    for value in (0.5, 0.1):
        path.write_text(f"wavelength_nm,R\n400,{value}\n700,{value}\n")
        sensor = IdealSensor(cfa="R", qe_csv=str(path), infrared_cut=False)
        assert_allclose(spectral_curve(sensor.model(), [500.0]), value)


@pytest.mark.parametrize(
    "text, message",
    [
        ("R,G\n1,2\n", "expected wavelength_nm"),
        ("wavelength_nm,R\n400,0.1\n300,0.1\n", "increasing"),
        ("wavelength_nm,R\n400,0.1\nnan,0.2\n600,0.1\n", "finite, increasing"),
        ("wavelength_nm,R\n400,0.1\ninf,0.1\n", "finite, increasing"),
        ("wavelength_nm,R\n400,0.1\n500,60\n", "within 0..1"),
        ("wavelength_nm,R\n400,x\n", "'x' in line 2, which is no number"),
        (
            "wavelength_nm,R\n400,0,1\n500,0,2\n",
            "3 values in line 2; expected 2.*points in decimal",
        ),
        ("wavelength_nm,R,R\n400,0.1,0.2\n500,0.1,0.2\n", "2 columns R; expected each name once"),
        ("wavelength_nm;R\n400;0,1\n500;0,2\n", "semicolons between its columns; expected commas"),
        ("wavelength_nm\tR\n400\t0.1\n500\t0.2\n", "tabs between its columns; expected commas"),
        ("", "is empty; expected a first line wavelength_nm,R,G,B"),
        ("wavelength_nm,R\n", "holds no numbers"),
        (None, "cannot be read"),
    ],
)
def test_bad_curves_are_refused(tmp_path, flat, text, message):
    path = tmp_path / "bad.csv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        IdealSensor(cfa="R", qe_csv=str(path)).expected(flat(1e-3))


@pytest.mark.parametrize("separator", [";", "\t"])
def test_the_command_that_a_refused_table_advises_makes_one_that_works(tmp_path, separator):
    path = tmp_path / "of a spreadsheet.csv"
    rows = (("wavelength_nm", "R"), ("400", "0,1"), ("700", "0,5"))
    path.write_text("".join(f"{separator.join(row)}\n" for row in rows))
    with pytest.raises(ConfigError, match="type for example tr ") as caught:
        IdealSensor(cfa="R", qe_csv=str(path)).model()
    command = str(caught.value).partition("type for example ")[2]
    subprocess.run(["sh", "-c", command], cwd=tmp_path, check=True)
    sensor = IdealSensor(cfa="R", qe_csv=str(tmp_path / "commas.csv"), infrared_cut=False)
    assert_allclose(spectral_curve(sensor.model(), [400.0, 700.0]), [[0.1, 0.5]])


def test_marks_comments_and_empty_cells_of_spreadsheets_change_nothing(tmp_path):
    path = tmp_path / "qe.csv"
    text = "wavelength_nm, R,,\r\n# measured\r\n400, 0.1,,\r\n,,,\r\n700, 0.5,,\r\n"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    sensor = IdealSensor(cfa="R", qe_csv=str(path), infrared_cut=False)
    assert_allclose(spectral_curve(sensor.model(), [400.0, 700.0]), [[0.1, 0.5]])


def test_a_table_that_is_no_utf_8_is_refused(tmp_path):
    path = tmp_path / "qe.csv"
    path.write_bytes("wavelength_nm,R\n400,0.1\n700,0.5\n".encode("utf-16"))
    with pytest.raises(ConfigError, match="is no text in UTF-8"):
        IdealSensor(cfa="R", qe_csv=str(path)).model()


def test_unknown_filter_and_impossible_scale_are_refused(flat):
    with pytest.raises(ConfigError, match="no spectral curve for filter 'X'"):
        IdealSensor(cfa="X").expected(flat(1e-3))
    with pytest.raises(ConfigError, match="expected at most 1"):
        IdealSensor(peak_qe=1.3, infrared_cut=False).expected(flat(1e-3))


def test_narrow_drops_only_bands_that_cannot_matter(make_light):
    w = tuple(np.arange(380.0, 851, 10))
    sensor = BayerSensor()
    ledger = Ledger()
    with stage(ledger, "sensor"):
        kept = sensor.narrow(Demand(wavelength_nm=w)).wavelength_nm
    assert set(kept) < set(w) and ledger[0].left_out[0].bound == 1e-6
    values = np.ones((len(w), 4, 4))
    inside = np.isin(w, kept)
    full = sensor.expected(make_light(values, 3.75, w)).values
    less = sensor.expected(make_light(values[inside], 3.75, kept)).values
    assert_allclose(less, full, rtol=1e-5)  # the bound of 1e-6 for each of 10 dropped bands
    assert replace(sensor.narrow(Demand()), response=None) == Demand()


def test_narrow_keeps_two_bands_where_only_the_last_one_is_seen(tmp_path):
    """The width of a band follows from the distance to its neighbour."""
    path = tmp_path / "edge.csv"
    path.write_text("wavelength_nm,W\n696,0\n698,0.5\n720,0.5\n730,0\n")
    sensor = IdealSensor(cfa="W", qe_csv=str(path), infrared_cut=False)
    kept = sensor.narrow(Demand(wavelength_nm=tuple(np.arange(400.0, 701, 10))))
    assert kept.wavelength_nm == (690.0, 700.0)


def test_a_smooth_spectrum_s_error_shrinks_with_the_square_of_the_band():
    model = BayerSensor().model()
    wide, middle, narrow = (
        smooth_spectrum_error(model, np.arange(380.0, 781, step)) for step in (20, 10, 5)
    )
    # the ratios are 4 for curves without edges
    assert narrow < 1e-3 and 2.5 < wide / middle < 6 and 2.5 < middle / narrow < 6


def triangle(tmp_path, centre_nm, half_nm):
    """Return a sensor that responds to one spectral line only: a triangle of height 1 that falls to
    0 at `half_nm` from `centre_nm`, the same in all channels.
    """
    path = tmp_path / f"line{centre_nm}.csv"
    rows = [(400, 0), (centre_nm - half_nm, 0), (centre_nm, 1), (centre_nm + half_nm, 0), (700, 0)]
    path.write_text("wavelength_nm,R,G,B\n" + "".join(f"{w},{q},{q},{q}\n" for w, q in rows))
    return IdealSensor(qe_csv=str(path), infrared_cut=False)


@pytest.mark.parametrize(
    "centre_nm", [552.0, 554.97, 555.0, 560.0]
)  # between band centres, across a border, at a centre
def test_a_line_narrower_than_a_band_counts_as_it_is(tmp_path, make_light, centre_nm):
    """For a response 0.1 nm wide in bands of 10 nm, the integral equals its closed form, and black
    bodies agree within the stated error.
    """
    sensor = triangle(tmp_path, centre_nm, 0.05)
    bands = np.arange(400.0, 701.0, 10.0)
    response = quantum_efficiency(sensor.model(), bands)[0] * bands
    # light of constant spectral energy: the integral of q w dw over a triangle is
    # height x half width x centre
    assert response.sum() * 10 == pytest.approx(0.05 * centre_nm, rel=1e-12)
    with stage(rows := Ledger(), "sensor"):
        shot = sensor(make_light(np.full((31, 4, 4), 1e-3), 3.75, bands), None)
    [note] = [e for e in rows[0].errors if e.acts_on == Quantity.ELECTRONS]
    assert np.isfinite(note.value) and 0 < note.value < 0.1 and float(shot.raw.min()) > 0
    fine = np.arange(395.0005, 705.0, 0.001)
    for kelvin in (2400.0, 6500.0, 15000.0):
        energy = planck_radiance(fine, kelvin)
        counted = response @ energy.reshape(31, -1).mean(1) * 10
        true = float(spectral_curve(sensor.model(), fine)[0] @ (energy * fine)) * 0.001
        assert abs(counted / true - 1) <= note.value + 1e-4  # 1e-4: sum in steps of 0.001 nm


def test_a_curve_that_no_band_holds_is_refused(tmp_path, make_light):
    sensor = triangle(tmp_path, 552.0, 0.05)
    for bands in (np.array([550.0]), np.arange(600.0, 681.0, 10.0)):
        with pytest.raises(ConfigError, match="has no response in the bands from"):
            sensor(make_light(np.full((len(bands), 4, 4), 1e-3), 3.75, bands), None)


def test_band_means_are_exact_for_straight_curves_and_keep_a_table_that_ends_at_the_last_centre(
    tmp_path,
):
    path = tmp_path / "straight.csv"
    path.write_text("wavelength_nm,R,G,B\n400,0.2,0.9,0.5\n700,0.8,0.3,0.5\n")
    model = IdealSensor(qe_csv=str(path), infrared_cut=False).model()
    bands = np.arange(400.0, 701.0, 10.0)
    means = quantum_efficiency(model, bands)
    slope = (spectral_curve(model, bands[1:-1] + 1) - spectral_curve(model, bands[1:-1] - 1)) / 2
    # q = q0 + b (w - c): its photon mean over a band of width h is q0 + b h^2 / (12 c)
    assert_allclose(
        means[:, 1:-1],
        spectral_curve(model, bands[1:-1]) + slope * 100 / (12 * bands[1:-1]),
        rtol=1e-12,
    )
    assert_allclose(means[:, [0, -1]], spectral_curve(model, np.array([402.5, 697.5])), rtol=1e-4)
    assert_allclose(
        quantum_efficiency(IdealSensor(curves="unit").model(), np.array([400.0, 430.0, 500.0])),
        1.0,
        rtol=1e-15,
    )


def test_filters_made_of_the_clear_one():
    w = np.arange(400.0, 701, 5)
    clear, yellow, magenta = (filter_curve(letter, w) for letter in "CYM")
    assert_array_equal(clear, filter_curve("W", w))
    assert np.all(yellow < clear) and np.all(magenta < clear)
    # yellow blocks blue
    assert_allclose(np.interp([450, 500, 600], w, yellow / clear), [0, 0.5, 1], atol=1e-3)
    # magenta blocks green
    assert_allclose(np.interp([450, 540, 650], w, magenta / clear), [1, 0.1, 1], atol=0.05)


def test_lower_case_letters_stand_after_their_filters():
    assert channels("RG/gb") == ("R", "G", "b", "g") and channels("RYYC") == ("R", "C", "Y")


@pytest.mark.parametrize("cfa", ["RGGB", "W"])
def test_any_spectrum_within_its_bands_stays_within_the_stated_bound(cfa):
    """Sum the electrons of random spectral lines in bands of 10 nm and at their own wavelengths.
    The difference stays within the bound; the worst spectrum exceeds a third of the bound, so the
    bound is not loose.
    """
    model = BayerSensor(cfa=cfa).model()
    bands = np.arange(400.0, 701.0, 10.0)
    bound = line_error(model, bands)
    response = quantum_efficiency(model, bands) * bands
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(200):
        lines_nm = rng.uniform(395.0, 705.0, rng.integers(1, 5))
        true = (spectral_curve(model, lines_nm) * lines_nm).mean(1)
        counted = response[:, np.clip(np.rint((lines_nm - 400.0) / 10.0).astype(int), 0, 30)].mean(
            1
        )
        worst = max(worst, float(np.abs(counted - true).max() / response.max()))
    assert bound / 3 < worst <= bound
    # bands a tenth as wide have a tenth of the error, and a little more at edges of the curves
    assert line_error(model, np.arange(400.0, 701.0, 1.0)) < 0.15 * bound
