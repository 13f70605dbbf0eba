"""Measured lenses: the same picture as the lens that a table was computed from, and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, HazeFlare, IdealLens
from isethdr_optics.lenses.measured_lens import MeasuredLens
from isethdr_optics.measured.spread import kernel, shares
from isethdr_optics.measured.table import load

from isethdr_core.data import quantities
from isethdr_core.errors import CatalogError, ConfigError, IsetHdrError, UnitError
from isethdr_core.uncertainty import ledger

WAVES = (450.0, 550.0, 650.0)
DIFFRACTION = DiffractionLimitedLens(falloff="none")


def mixed(values, pitch_um=2.0, wave=(500.0, 600.0), focal_mm=4.0):
    values = np.broadcast_to(values, (len(wave), *np.shape(values)[-2:])).astype(float)
    y, x = (quantities.centres(n, n * pitch_um * 1e-3 / focal_mm) for n in values.shape[-2:])
    return quantities.plane(values, wave, x, y, quantities.RADIANCE)


@pytest.fixture(scope="module")
def airy():
    """Return the arrays of a table of the diffraction-limited lens at f/4."""
    psf = DIFFRACTION.psf(WAVES, pitch_um=0.5, size=161).values
    return {
        "psf": np.stack([psf, psf]),
        "pitch_um": 0.5,
        "field_deg": [0.0, 20.0],
        "wavelength_nm": WAVES,
        "energy": np.stack([psf.sum((1, 2))] * 2),
        "relative_illumination": [1.0, 1.0],
    }


def saved(path, arrays, **changed):
    arrays = {k: v for k, v in {**arrays, **changed}.items() if v is not None}
    np.savez(path, **arrays)
    return str(path)


def edge():
    values = np.full((48, 72), 0.2)
    values[:, 36:] = 5.0
    values[10, 12] = 40.0
    return values


def test_a_table_of_the_diffraction_lens_gives_its_picture(tmp_path, airy):
    lens = MeasuredLens(saved(tmp_path / "a.npz", airy))
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        found = lens(mixed(edge())).values
    wanted = DIFFRACTION(mixed(edge())).values
    stated = {term.source.key: term.value for term in book[0].errors}
    assert stated["beyond the samples"] == pytest.approx(2 * (1 - airy["energy"].min()), rel=1e-9)
    # The L1 error of a kernel is at most twice the light that it misplaces. So no tile errs by more
    # than the sum of the stated errors times the brightest light around it.
    worst = np.abs(found - wanted).max() / wanted.max()
    assert worst < stated["beyond the samples"] + stated["wavelengths"] + stated["angles"]
    inner = (slice(None), slice(8, -8), slice(8, -8))
    mean = np.abs(found - wanted)[inner].sum() / wanted[inner].sum()
    assert mean < 0.015  # measured: 0.0096, most of it from light beyond the samples


def test_the_edge_of_the_picture_keeps_the_light(tmp_path, airy):
    table = load(saved(tmp_path / "a.npz", airy), "", 4.0)
    for azimuth in (0.0, 0.3, 2.0):
        for tile in ((2.0, 2.0), (0.3, 0.2), (5.0, 7.0)):
            found = kernel(table.psf[0, 0], 0.5, tile, azimuth)
            assert found.sum() == pytest.approx(1.0, rel=1e-12) and found.min() >= 0


def test_weights_of_places_sum_to_one():
    table = load("example", "", 5.6)
    x = np.linspace(-0.5, 0.5, 31)
    y = np.linspace(-0.3, 0.3, 19)
    total = np.zeros((19, 31))
    for share in shares(table, np.tan(np.radians(table.field_deg)), x, y):
        total[share.window] += share.weights
    np.testing.assert_allclose(total, 1.0, rtol=1e-12)


def test_a_point_spread_of_one_sample_is_the_ideal_lens(tmp_path, airy):
    one = np.zeros((2, 3, 5, 5))
    one[:, :, 2, 2] = 7.0
    lens = MeasuredLens(saved(tmp_path / "a.npz", airy, psf=one, energy=None))
    light = mixed(edge())
    np.testing.assert_allclose(lens(light), IdealLens(falloff="none")(light), rtol=1e-6)
    haze = {"haze": HazeFlare()}
    with_haze = lens(light, haze).values
    np.testing.assert_allclose(with_haze, IdealLens(falloff="none")(light, haze), rtol=1e-6)


@pytest.mark.parametrize("x, y", [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_a_point_spread_turns_with_the_field(tmp_path, airy, x, y):
    # a second spot 6 um farther from the axis; the table holds the PSF of a field point on +x
    two = np.zeros((2, 3, 31, 31))
    two[:, :, 15, 15] = 0.5
    two[1, :, 15, 27] = 0.5
    arrays = {**airy, "psf": two, "energy": None, "field_deg": [0.0, 1.0]}
    arrays["relative_illumination"] = None
    lens = MeasuredLens(saved(tmp_path / "a.npz", arrays))
    values = np.zeros((61, 61))
    values[30 + 20 * y, 30 + 20 * x] = 1.0
    out = lens(mixed(values)).values[0]
    found = {tuple(at) for at in np.argwhere(out > 0.3 * out.max())}
    assert found == {(30 + 20 * y, 30 + 20 * x), (30 + 23 * y, 30 + 23 * x)}


def test_illumination_and_distortion_come_from_their_table(tmp_path, airy):
    (tmp_path / "f.csv").write_text(
        "field_deg,relative_illumination,distortion_percent,chief_ray_deg\n"
        "0,1,0,0\n1,0.8,-1,5\n2,0.6,-4,9\n"
    )
    arrays = {**airy, "relative_illumination": None}
    lens = MeasuredLens(saved(tmp_path / "a.npz", arrays), figures=str(tmp_path / "f.csv"))
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        light = lens(mixed(np.full((40, 60), 0.1)))
    table = light.attrs["falloff_table"]
    assert table["relative"] == [1.0, 0.8, 0.6] and table["angle_deg"] == [0.0, 1.0, 2.0]
    radius = light.attrs["distortion"]["radius_per_focal_length"]
    assert radius == pytest.approx(np.tan(np.radians([1, 2])) * [0.99, 0.96], rel=1e-12)
    assert {row.what: row.bound for row in book[0].left_out}["angle of the chief ray"] == 9.0
    chief = light.attrs["chief_rays"]
    assert chief["angle_deg"] == [0.0, 5.0, 9.0]
    assert chief["radius_per_focal_length"] == pytest.approx([0.0, *radius], rel=1e-12)


def test_a_table_without_chief_rays_states_none(tmp_path, airy):
    light = MeasuredLens(saved(tmp_path / "a.npz", airy))(mixed(np.full((8, 8), 0.1)))
    assert "chief_rays" not in light.attrs


def test_a_field_beyond_the_table_is_refused_at_once(tmp_path, airy):
    arrays = {**airy, "field_deg": [0.0, 1.0]}
    lens = MeasuredLens(saved(tmp_path / "a.npz", arrays))
    for call in (lambda: lens.image_size_m(0.2, 0.1), lambda: lens(mixed(edge()))):
        with pytest.raises(ConfigError, match="relative_illumination of .* ends at 1 degrees"):
            call()


def mtf_csv(path, f_number=4.0, change=None):
    """Write the diffraction MTF (Goodman 2005, eq. 6-31) of two wavelengths, on the axis."""
    lines = ["field_deg,wavelength_nm,frequency_per_mm,mtf_tangential,mtf_sagittal"]
    for wave in (500.0, 600.0):
        limit = 1e6 / (wave * f_number)
        for part in np.linspace(0, 1, 41):
            value = 2 / np.pi * (np.arccos(part) - part * np.sqrt(1 - part**2))
            lines.append(f"0,{wave},{part * limit},{value},{value}")
    text = "\n".join(lines)
    path.write_text(text.replace(*change, 1) if change else text)
    return str(path)


def test_diffraction_mtf_gives_the_picture_of_the_diffraction_lens(tmp_path):
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        found = MeasuredLens(mtf_csv(tmp_path / "a.csv"))(mixed(edge())).values
    wanted = DiffractionLimitedLens()(mixed(edge())).values
    inner = (slice(None), slice(8, -8), slice(8, -8))
    # measured: 0.0081, since a PSF from an MTF repeats after 129 samples of 0.5 um, so its wings
    # alias
    assert np.abs(found - wanted)[inner].sum() / wanted[inner].sum() < 0.01
    stated = {term.source.key: term.value for term in book[0].errors}
    assert stated.get("phase of the MTF", 0.0) < 1e-3
    table = load(str(tmp_path / "a.csv"), "", 4.0)
    found = DIFFRACTION.psf(table.wavelength_nm, table.pitch_um, table.psf.shape[-1])
    inside = found.values.sum((1, 2))
    # the stated light beyond the samples is not less than that of the lens, and at most 1 % more
    assert np.all(table.energy[0] <= inside)
    np.testing.assert_allclose(1 - table.energy[0], 1 - inside, rtol=0.01)
    assert stated["beyond the samples"] == pytest.approx(2 * (1 - table.energy.min()))


def test_a_flare_in_the_pupil_is_refused(tmp_path, airy):
    lens = MeasuredLens(saved(tmp_path / "a.npz", airy))
    with pytest.raises(ConfigError, match="type ~flare.dirt"):
        lens(mixed(edge()), [ApertureFlare()])


BAD = [
    ({"pitch_um": None}, UnitError, "states no scale; expected pitch_um"),
    ({"pitch_um": -1.0}, UnitError, "pitch_um is -1"),
    ({"wavelength_nm": None}, UnitError, "lacks wavelength_nm"),
    ({"wavelength_nm": [0.4, 0.5, 0.6]}, UnitError, "begins at 0.4; expected nanometres"),
    (
        {"wavelength_nm": [450.0, 550.0]},
        UnitError,
        "expected .field, wavelength, y, x., here 2 x 2",
    ),
    ({"field_deg": [5.0, 20.0]}, UnitError, "degrees that rise from 0"),
    ({"energy": [[2.0] * 3] * 2}, UnitError, "energy is not within 0 to 1"),
    ({"relative_illumination": [1.0, -0.5]}, UnitError, "relative_illumination holds"),
    ({"distortion_percent": [0.0]}, UnitError, "distortion_percent has 1 values"),
    ({"distortion_percent": [0.0, -2.0]}, UnitError, "has 2 angles up to 20 .* three or more"),
    ({"relative_illumination": [0.0, 1.0]}, UnitError, "relative_illumination is 0 on the axis"),
    ({"energy": [1.0, 1.0]}, UnitError, "energy is 2; expected .field, wavelength., here 2 x 3"),
    ({"wavelength_nm": [450.0, 550.0, np.inf]}, UnitError, "expected nanometres"),
    ({"pitch_um": []}, UnitError, "pitch_um holds 0 values"),
    ({"psf": np.full((2, 3, 5, 5), "a")}, UnitError, "psf holds 150 values of type <U1"),
]


@pytest.mark.parametrize("changed, error, message", BAD)
def test_bad_tables_are_refused_in_one_line(tmp_path, airy, changed, error, message):
    with pytest.raises(error, match=message) as caught:
        MeasuredLens(saved(tmp_path / "a.npz", airy, **changed))
    assert isinstance(caught.value, IsetHdrError) and "\n" not in str(caught.value)


def test_the_scale_of_a_point_spread_does_not_matter_even_near_the_largest_float(tmp_path, airy):
    huge = airy["psf"] / airy["psf"].max() * 1e308
    found = load(saved(tmp_path / "a.npz", airy, psf=huge), "", 4.0).psf
    np.testing.assert_allclose(found, load(saved(tmp_path / "b.npz", airy), "", 4.0).psf, rtol=1e-9)


def test_negative_light_missing_files_and_curves_are_refused(tmp_path, airy):
    for value in (-1e-3, np.nan, np.inf):
        wrong = airy["psf"].copy()
        wrong[1, 2, 3, 4] = value
        with pytest.raises(UnitError, match=r"at 20 degrees and 650 nm, sample \(3, 4\)"):
            MeasuredLens(saved(tmp_path / "a.npz", airy, psf=wrong))
    with pytest.raises(CatalogError, match="none.npz is not a file"):
        MeasuredLens("none.npz")
    with pytest.raises(ConfigError, match="type for example lens.table=lens.npz"):
        MeasuredLens("lens.xls")
    for change, message in (
        (("0,500.0,0.0,1.0", "0,500.0,0.0,0.9"), "MTF at frequency 0"),
        (("0,500.0,0.0,1.0", "0,500.0,0.0,1.2"), "mtf_tangential holds 1.2; expected 0"),
        (("0,500.0,0.0,1.0,1.0\n", ""), "the frequencies are"),
        (("0,500.0,0.0", "0,0,0.0"), "wavelength_nm holds 0; expected nanometres, 100 or more"),
        (("mtf_sagittal", "sagittal"), "lacks mtf_sagittal"),
        (("0,500.0,0.0", "0,500.0,x"), "no number"),
        (("mtf_sagittal", "mtf_tangential"), "2 columns mtf_tangential; expected each name once"),
        (("0,500.0,0.0", "0;500.0;0.0"), "3 values in line 2; expected 5"),
    ):
        with pytest.raises(UnitError, match=message):
            MeasuredLens(mtf_csv(tmp_path / "b.csv", change=change))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; expected a first line field_deg,"),
        ("field_deg,chief_ray_deg\n", "holds no numbers"),
        ("field_deg;chief_ray_deg\n0;0\n45;20,5\n", "semicolons .*expected commas"),
        ("field_deg,chief_ray_deg,chief_ray_deg\n0,0,0\n45,20,9\n", "2 columns chief_ray_deg"),
    ],
)
def test_bad_figures_are_refused(tmp_path, airy, text, message):
    (tmp_path / "figures.csv").write_text(text)
    with pytest.raises(UnitError, match=message) as caught:
        MeasuredLens(saved(tmp_path / "a.npz", airy), str(tmp_path / "figures.csv"))
    assert str(caught.value).startswith(str(tmp_path))


def test_a_byte_order_mark_is_no_part_of_the_first_column(tmp_path, airy):
    plain = tmp_path / "figures.csv"
    plain.write_text("field_deg,chief_ray_deg\n0,0\n45,20\n", encoding="utf-8-sig")
    table = load(saved(tmp_path / "a.npz", airy), str(plain), 4.0)
    np.testing.assert_array_equal(table.figures["chief_ray_deg"], [[0, 45], [0, 20]])
    curves = tmp_path / "curves.csv"
    text = Path(mtf_csv(curves)).read_text()
    curves.write_text(text, encoding="utf-8-sig")
    assert load(str(curves), "", 4.0).field_deg.tolist() == [0.0]


def test_the_point_spread_is_a_point_s_light_on_each_sample(tmp_path, airy):
    """Compare a table of the diffraction-limited lens with the lens itself, and closed forms.

    1e-6 of the peak: three samples of the table fill one of this grid, so that no sample is cut.
    """
    integrals = DIFFRACTION.psf([550.0], pitch_um=0.5, size=97, integrated=True).values
    arrays = {**airy, "psf": np.stack([integrals] * 2), "wavelength_nm": [550.0], "energy": None}
    found = MeasuredLens(saved(tmp_path / "a.npz", arrays)).psf([550.0], 1.5, 31).values[0]
    wanted = DIFFRACTION.psf([550.0], pitch_um=1.5, size=31, integrated=True).values[0]
    share = integrals.sum()  # the table lacks the rest, and is scaled to 1
    np.testing.assert_allclose(share * found, wanted, atol=1e-6 * wanted.max())
    even = MeasuredLens(saved(tmp_path / "b.npz", airy, psf=np.ones((2, 3, 41, 41)), energy=None))
    # 41 samples of 0.5 um hold all samples of 1 um of this grid, its first row included
    np.testing.assert_allclose(even.psf([550.0], 1.0, 8).values, (1.0 / 20.5) ** 2, rtol=1e-12)
    one = np.zeros((2, 3, 5, 5))
    one[:, :, 2, 2] = 1.0
    narrow = MeasuredLens(saved(tmp_path / "c.npz", airy, psf=one, energy=None))
    assert narrow.psf([550.0], pitch_um=1.0, size=5).values[0, 2, 2] == pytest.approx(1.0)


def test_chief_rays_beyond_90_degrees_have_no_tangent(tmp_path, airy):
    (tmp_path / "figures.csv").write_text("field_deg,chief_ray_deg\n0,0\n45,20\n95,40\n")
    lens = MeasuredLens(saved(tmp_path / "a.npz", airy), str(tmp_path / "figures.csv"))
    rays = lens(mixed(np.ones((6, 8)))).attrs["chief_rays"]
    assert rays["angle_deg"] == [0.0, 20.0]
    assert rays["radius_per_focal_length"] == pytest.approx([0.0, 1.0])
