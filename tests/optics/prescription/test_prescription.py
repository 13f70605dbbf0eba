"""Prescriptions: published figures, values by hand, laws of scaling, relative illumination, the
lens built from a prescription, bad input.
"""

import copy
from dataclasses import replace

import numpy as np
import pytest
import yaml
from isethdr_optics import DiffractionLimitedLens, GhostFlare, PrescribedLens
from isethdr_optics.prescription import figures
from isethdr_optics.prescription.coatings import Powers, layers
from isethdr_optics.prescription.figures import (
    chief_mm,
    chief_rays,
    distortion,
    pupil_area_mm2,
    relative_illumination,
    spot,
    working_f_number,
)
from isethdr_optics.prescription.prescription import load, names, parse

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.paraxial import back_focus_mm
from isethdr_core.physics.optics.thin_film import reflect_unpolarised
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import ErrorTerm

GOOD = {
    "name": "mine",
    "f_number": 4.0,
    "surfaces": [
        {"stop": True, "thickness_mm": 1.0, "semi_diameter_mm": 5.0},
        {"radius_mm": 50.0, "thickness_mm": 4.0, "glass": "1.5", "semi_diameter_mm": 8.0},
        {"radius_mm": -80.0, "semi_diameter_mm": 8.0},
    ],
}


def test_published_focal_lengths_and_back_focus():
    """The designs are distributed as 100 mm f/3 with a back focus of 61.487536 mm, and as 50 mm
    f/5.
    """
    gauss = load("double_gauss")
    triplet = load("cooke_triplet")
    assert gauss.focal_length_mm() == pytest.approx(100.0, abs=0.01)
    # glass catalogues differ in the sixth digit
    assert back_focus_mm(gauss.surfaces[:-1], gauss.indices(587.56)) == pytest.approx(
        61.487536, abs=2e-4
    )
    assert triplet.focal_length_mm(550.0) == pytest.approx(50.0, abs=0.01)


def test_every_preset_reads_and_opens_to_its_f_number():
    assert {"singlet", "cooke_triplet", "double_gauss", "double_gauss_camera"} <= set(names())
    for name in names():
        lens = load(name)
        assert lens.source
        opened = lens.stopped(lens.f_number)
        # the marginal ray of a corrected lens keeps the sine condition to a few percent
        assert working_f_number(opened) == pytest.approx(lens.f_number, rel=0.03)
        assert working_f_number(lens.scaled(4.0).stopped(11.0)) == pytest.approx(11.0, rel=5e-3)


def test_singlet_by_hand():
    lens = parse(GOOD)
    power = 0.5 * (1 / 50 + 1 / 80 - 0.5 * 4 / (1.5 * 50 * 80))
    assert lens.focal_length_mm() == pytest.approx(1 / power, rel=1e-12)
    assert lens.surfaces[-1].z_mm - lens.surfaces[-2].z_mm == pytest.approx(
        (1 - 0.5 * 4 / (1.5 * 50)) / power, rel=1e-12
    )


def test_scaling_keeps_angles():
    lens = load("double_gauss").stopped(4.0)
    small = lens.scaled(4.0)
    assert small.focal_length_mm() == pytest.approx(4.0, rel=1e-12)
    t = np.array([0.05, 0.2])
    np.testing.assert_allclose(
        chief_mm(small, t, 550.0) * lens.focal_length_mm() / 4.0,
        chief_mm(lens, t, 550.0),
        rtol=1e-9,
    )
    assert working_f_number(small) == pytest.approx(working_f_number(lens), rel=1e-9)
    aspheric = copy.deepcopy(GOOD)
    aspheric["surfaces"][1] |= {"aspheric": [-1e-5, 2e-8], "conic": -0.5}
    lens = parse(aspheric).stopped(6.0)
    assert working_f_number(lens.scaled(7.0)) == pytest.approx(working_f_number(lens), rel=1e-9)


def test_chief_rays_tend_to_the_tangent_law_and_distortion_grows_with_its_square():
    lens = load("double_gauss").stopped(4.0)
    d = distortion(lens, [0.0, 0.02, 0.04])
    assert d[0] == 0 and d[2] / d[1] == pytest.approx(4, rel=0.02)  # third-order law
    assert distortion(lens, np.tan(np.radians(14.0)))[0] == pytest.approx(-0.0105, abs=2e-4)
    np.testing.assert_allclose(distortion(lens, [-0.1]), distortion(lens, [0.1]), rtol=1e-6)


def test_the_angle_of_a_chief_ray_is_that_of_its_path_behind_the_lens():
    lens = load("double_gauss").stopped(4.0)
    tangents = np.array([0.0, 0.1, 0.2])
    rays = chief_rays(lens, tangents)
    behind = replace(lens.surfaces[-1], z_mm=lens.surfaces[-1].z_mm + 1.0)
    further = replace(lens, surfaces=(*lens.surfaces[:-1], behind))
    moved_mm = chief_mm(further, tangents, lens.reference_nm) - rays.height_mm
    # 1e-9: rays are aimed to 1e-12, and heights of 10 mm are subtracted after a path of 1 mm
    np.testing.assert_allclose(moved_mm, np.tan(np.radians(rays.angle_deg)), atol=1e-9)
    assert rays.angle_deg[0] == pytest.approx(0.0, abs=1e-9) and rays.angle_deg[2] > 5
    small = chief_rays(lens.scaled(4.0), tangents)
    np.testing.assert_allclose(small.angle_deg, rays.angle_deg, atol=1e-8)  # scaling keeps angles
    mirrored = chief_rays(lens, -tangents)
    np.testing.assert_allclose(mirrored.angle_deg, -rays.angle_deg, atol=1e-8)


def test_a_stop_in_front_gives_cos4_over_the_jacobian():
    """Compare with closed forms: nothing vignettes, and the entrance pupil is the stop itself, so
    relative illumination is cos4 over the Jacobian of the distortion.
    """
    lens = load("singlet").stopped(8.0)
    t = np.array([0.05, 0.1, 0.15])
    area = pupil_area_mm2(lens, t, 550.0)
    stop = np.pi * lens.surfaces[lens.stop].semi_diameter_mm ** 2
    np.testing.assert_allclose(area, stop, rtol=2e-4)  # 2e-4: 160 cells across the beam
    d = distortion(lens, t)
    step = 1e-4
    around = 1 + d
    wide = (t + step) * (1 + distortion(lens, t + step)) - (t - step) * (
        1 + distortion(lens, t - step)
    )
    np.testing.assert_allclose(
        relative_illumination(lens, t), (1 + t**2) ** -2 / (around * wide / (2 * step)), rtol=5e-4
    )


def test_apertures_vignette_by_the_area_of_their_overlap():
    """Compare with a closed form: two apertures of radius r at a distance d transmit, at field
    tangent t, the overlap of two discs whose centres are d t apart.
    """
    data = copy.deepcopy(GOOD)
    data["surfaces"] = [
        {"stop": True, "thickness_mm": 20.0, "semi_diameter_mm": 5.0},
        {"radius_mm": 1e5, "thickness_mm": 1e-3, "glass": "1.5", "semi_diameter_mm": 5.0},
        {"radius_mm": -1e5},
    ]
    lens = parse(data)
    t = 0.1
    r = 5.0
    half = 20 * t / 2
    overlap = 2 * r**2 * np.arccos(half / r) - 2 * half * np.sqrt(r**2 - half**2)
    assert pupil_area_mm2(lens, [t], 550.0)[0] == pytest.approx(overlap, rel=2e-3)  # 160 cells


def test_tables_of_coatings_follow_the_matrices():
    lens = load("double_gauss_camera")
    wave = np.array([450.0, 550.0])
    powers = Powers(lens, wave)
    cosine = np.array([0.95, 0.723, 0.5])
    got = powers(0, True, True, np.broadcast_to(cosine, (2, 3)))
    for band, w in enumerate(wave):
        want = reflect_unpolarised(
            1.0, powers.indices[1][band], layers("multilayer", w), cosine, w
        )[0]
        np.testing.assert_allclose(got[band], want, atol=1e-5)
    assert (
        powers(lens.stop, True, True, cosine) == 0 and powers(lens.stop, False, True, cosine) == 1
    )
    filtered = Powers(lens, [550.0, 850.0]).at_normal(11)
    assert filtered[0] < 0.15 and filtered[1] > 0.99


def test_the_lens_reduces_to_the_perfect_one_on_its_axis():
    x = quantities.centres(31, 0.1)
    scene = quantities.plane(np.full((1, 31, 31), 2.0), [550.0], x, x, quantities.RADIANCE)
    real = PrescribedLens(f_number=8.0, distortion="none", wavefront="none")
    perfect = DiffractionLimitedLens(f_number=8.0, pupil="aplanatic")
    ratio = real(scene) / perfect(scene)
    # 4e-3: the double Gauss at f/8 obeys the sine condition to 2e-3. 2 %: its falloff follows cos4
    # to 1 % within 3 degrees
    assert float(ratio[0, 15, 15]) == pytest.approx(1.0, abs=4e-3)
    assert float(abs(ratio - 1).max()) < 0.02
    assert real.relative_illumination([0.0, 0.1])[1] == pytest.approx(1.01**-2, rel=0.03)


def test_spherical_aberration_of_a_singlet_grows_with_the_cube_of_its_aperture():
    wide, narrow = (spot(parse(GOOD).stopped(n), 0.0).radius_mm for n in (8.0, 16.0))
    # the cube holds for third-order aberration; the fifth order adds 1 % at f/8
    assert wide / narrow == pytest.approx(8.0, rel=0.02)


@pytest.mark.slow
def test_the_lens_says_what_it_leaves_out():
    x = quantities.centres(15, 0.3)
    scene = quantities.plane(np.ones((1, 15, 15)), [550.0], x, x, quantities.RADIANCE)
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        PrescribedLens(f_number=4.0, distortion="none", wavefront="none")(scene)
    bounds = {o.what.split()[0]: o.bound for o in rows[0].left_out if "prescription" in o.what}
    assert 1e-3 < bounds["distortion"] < 2e-2 and 1e-8 < bounds["geometric"] < 1e-5


def test_cells_far_outside_a_beam_do_not_count():
    """Rays that miss a surface next to rays far outside a rim are no border of a beam."""
    inside = figures._inside
    y, x = np.mgrid[-100:101, -100:101] * 0.02
    beam = 1 - x**2 - y**2
    # 2e-3: the first order in the margin
    assert inside(beam).sum() * 0.02**2 == pytest.approx(np.pi, rel=2e-3)
    beam[:3] = np.nan
    beam[3:6] = -6.0
    assert inside(beam).sum() * 0.02**2 == pytest.approx(np.pi, rel=2e-3)
    assert not inside(beam)[:6].any()


def test_a_file_in_the_home_folder_is_found_and_named(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(GOOD))
    lens = PrescribedLens(f_number=8.0, prescription="~/own.yaml")
    assert lens.real().name == "mine"
    assert lens.input_files() == GhostFlare("~/own.yaml").input_files() == (path,)


def test_a_slow_stop_keeps_the_beam_that_its_aberrated_pupil_lets_in():
    # at f/200 the entrance pupil of the triplet moves by more than two radii at 20 degrees
    def beam(f_number):
        axis, oblique = pupil_area_mm2(load("cooke_triplet").stopped(f_number), [0.0, 0.364])
        return oblique / axis

    assert beam(200.0) == pytest.approx(beam(16.0), rel=5e-3)  # the rims cut neither beam
    lens = PrescribedLens(prescription="cooke_triplet", f_number=200.0)
    assert lens.relative_illumination(0.364) == pytest.approx(0.88, abs=0.01)
    assert 4 in lens.wavefront_at(0.349)
    assert lens._uneven(0.349, np.array([550.0])) < 0.02  # rays from the sensor find the pupil too


def test_a_table_of_focal_shifts_has_no_error_between_traced_wavelengths():
    def keys(**focus):
        lens = PrescribedLens(f_number=5.6, prescription="singlet", **focus)
        notes = lens.limits(0.02, np.array([550.0]))
        return [note.source.key for note in notes if isinstance(note, ErrorTerm)]

    assert "traced wavelengths" in keys()
    assert "traced wavelengths" not in keys(focal_shift_um={400.0: 9.0, 700.0: 0.0})


def broken(change):
    data = copy.deepcopy(GOOD)
    change(data)
    return data


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["surfaces"][1].update(thickness_mm=-4.0), "thickness_mm is -4"),
        (lambda d: d["surfaces"][0].pop("stop"), "0 stops"),
        (lambda d: d["surfaces"][0].update(thickness_mm=100.0), "outside the lens"),
        (lambda d: d["surfaces"].append(d["surfaces"].pop(0)), "outside the lens"),
        (lambda d: d.update(f_number=0.4), "at least 0.5"),
        (lambda d: d["surfaces"][1].update(glass="N-BK8"), "did you mean 'N-BK7'"),
        (lambda d: d["surfaces"][1].update(coating="gold"), "coating 'gold'"),
        (lambda d: d["surfaces"][1].update(radius=50.0), "'radius' is unknown"),
        (lambda d: d["surfaces"][1].update(radius_mm=0.0), "radius_mm is 0"),
        (lambda d: d["surfaces"][1].update(radius_mm=-50.0), "focal length"),
        (lambda d: d["surfaces"][1].update(semi_diameter_mm=-1.0), "semi_diameter_mm"),
        (lambda d: d["surfaces"][1].update(role="window"), "role"),
        (lambda d: d["surfaces"].pop(), "ends in 1.5"),
        (lambda d: d.update(surfaces=[]), "at least one row"),
        (lambda d: d["surfaces"][1].update(aspheric=1e-6), "aspheric is 1e-06; expected a list"),
        (lambda d: d["surfaces"][1].update(odd_aspheric=["a"]), "odd_aspheric is .*list of num"),
        (lambda d: d["surfaces"][1].update(aspheric=[np.nan]), "aspheric is .*list of numbers"),
        (lambda d: d["surfaces"][1].update(glass="conrady:1.5,0.01@300-700"), "2 coefficients"),
        (lambda d: d.update(half_field_deg=-5.0), "half_field_deg is -5"),
        (lambda d: d.update(half_field_deg=95.0), "half_field_deg is 95"),
    ],
)
def test_bad_prescriptions_are_refused(change, said):
    with pytest.raises(ConfigError, match=said):
        parse(broken(change))


def test_bad_use_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="did you mean 'singlet'"):
        load("singlett")
    with pytest.raises(ConfigError, match=r"opens to f/4"):
        parse(GOOD).stopped(2.0)
    with pytest.raises(ConfigError, match="undefined at"):
        load("singlet").indices(200.0)
    with pytest.raises(ConfigError, match="miss a surface"):
        chief_mm(load("double_gauss").stopped(4.0), [3.0], 550.0)
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(GOOD))
    assert load(str(path)).name == "mine"
    path.write_text("surfaces: [")
    with pytest.raises(ConfigError, match="expected YAML"):
        load(str(path))
    with pytest.raises(ConfigError, match="f/3"):
        PrescribedLens(f_number=2.0)
