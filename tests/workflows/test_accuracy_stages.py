"""Stages of the study of accuracy: each reference obeys laws that it does not use, and each diagram
is drawn.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from isethdr_measured import accuracy
from isethdr_measured.accuracy import (
    aberrated,
    basis,
    denoise,
    field,
    ghosts,
    ghosts_by_chance,
)
from isethdr_workflows.accuracy import diagram, point
from isethdr_workflows.accuracy.point import Point, Work

from isethdr_core.physics.optics.surfaces import Surface


@pytest.fixture(autouse=True)
def once(monkeypatch):
    """Repeat no call to measure its time, because times are not tested."""
    monkeypatch.setattr(point, "SHORT_S", 0.0)


def marked(work, mark):
    return next(p for p in work.points if p.mark == mark)


@pytest.mark.slow
def test_more_places_of_the_field_are_better_and_shares_are_better_than_patches(monkeypatch):
    monkeypatch.setattr(field, "SHAPE", (5, 7))
    monkeypatch.setattr(field, "FIELD_ZERNIKE_UM", {0: {}, 0.4: {8: 0.16, 5: 0.08}})
    monkeypatch.setattr(field, "RINGS", (0, 1, 2))
    monkeypatch.setattr(field, "PATCHES", (2,))
    (work,) = field.measured()
    none, one, two, patches, default = work.points
    # linear interpolation between places has an error that grows with the square of their distance
    assert none.error > 3 * one.error and one.error > 1.5 * two.error
    assert patches.error > 1.5 * two.error  # the same places
    assert default.mark == "default" and default.error < 0.05  # the error that the lens allows
    assert none.mark == patches.mark == "peer"


def test_fresnel_s_laws():
    straight, bent = ghosts_by_chance.fresnel(np.array([1.0]), 1.0, 1.5)
    # ((n - 1) / (n + 1))^2
    assert straight[0] == pytest.approx(0.04, rel=1e-6) and bent[0] == pytest.approx(1.0)
    # at Brewster's angle, light polarised in the plane of incidence is not reflected: half of
    # ((n^2 - 1) / (n^2 + 1))^2 is left
    brewster = np.cos(np.arctan(1.5))
    assert ghosts_by_chance.fresnel(np.array([brewster]), 1.0, 1.5)[0][0] == pytest.approx(
        0.5 * (1.25 / 3.25) ** 2, rel=1e-9
    )
    beyond, nowhere = ghosts_by_chance.fresnel(np.array([0.5]), 1.5, 1.0)
    assert beyond[0] == 1.0 and nowhere[0] == 0.0


def slow_singlet(indices):
    """Return a lens of two weak surfaces behind a narrow stop, and a sensor."""
    surfaces = [
        Surface(0.0, semi_diameter_mm=1.0, is_stop=True),
        Surface(1.0, 1 / 400.0),
        Surface(5.0, -1 / 500.0),
        Surface(150.0),
    ]
    return SimpleNamespace(surfaces=surfaces, indices=lambda nm: indices)


def test_light_of_a_ghost_by_hand():
    """At almost normal incidence, the ghost has T1 R2 R1 T2 of the light through the stop, all on
    one block. Rays start on a disc that is larger than the stop by a margin.
    """
    edges = np.array([-50.0, 50.0])
    mean, error = ghosts_by_chance.flux_by_chance(
        slow_singlet([1.0, 1.0, 1.9, 1.0, 1.0]),
        0.0,
        550.0,
        edges,
        ghosts_by_chance.Photons(4096, 6),
    )
    r = (0.9 / 2.9) ** 2
    # 2e-3: the border of the stop lies between uniformly scattered points
    assert mean[0, 0] == pytest.approx(np.pi * r**2 * (1 - r) ** 2, rel=2e-3)
    assert 0 < error[0, 0] < 2e-3 * mean[0, 0]
    none, _ = ghosts_by_chance.flux_by_chance(
        slow_singlet([1.0] * 5), 0.0, 550.0, edges, ghosts_by_chance.Photons(64, 2)
    )
    assert none[0, 0] == 0.0


def test_the_error_of_photons_is_what_other_photons_find():
    edges = np.linspace(-6, 6, 7)
    lens = slow_singlet([1.0, 1.0, 1.9, 1.0, 1.0])
    found = [
        ghosts_by_chance.flux_by_chance(
            lens, 0.01, 550.0, edges, ghosts_by_chance.Photons(256, 4, seed=s)
        )
        for s in range(24)
    ]
    scatter = np.std([m for m, _ in found], axis=0, ddof=1)
    stated = np.sqrt(np.mean([e**2 for _, e in found], axis=0))
    lit = scatter > 0.05 * scatter.max()
    assert lit.sum() >= 4
    # chi squared of 23 and of 24 x 3 degrees of freedom: one block gives the ratio to 17 %, and
    # several blocks give it better
    assert np.median(stated[lit] / scatter[lit]) == pytest.approx(1.0, abs=0.3)


@pytest.mark.slow
def test_more_pairs_and_rays_are_better_down_to_the_reference(monkeypatch):
    monkeypatch.setattr(ghosts, "PHOTONS", 2**10)
    monkeypatch.setattr(ghosts, "BATCHES", 4)
    monkeypatch.setattr(ghosts, "ALLOWED", (0.1, 0.01))
    monkeypatch.setattr(ghosts, "NODES", (4, 16))
    pairs, rays = ghosts.measured()
    none, some, all_pairs, discs = pairs.points
    assert none.error > 2 * some.error and some.error > 2 * all_pairs.error
    # without coatings: a few pairs of 15 reflect (4 to 6 %)^2, and a part falls on the frame
    assert 0.01 < none.error < 0.05
    assert discs.mark == "peer" and discs.error > 5 * all_pairs.error
    # ghosts of all pairs state an error of 4 % of a tile's light, and blocks average over tiles;
    # the error of the photons is added
    assert all_pairs.error < 0.05 * none.error + 2 * pairs.reference_error
    assert rays.points[0].error > 3 * rays.points[1].error == pytest.approx(3 * all_pairs.error)


@pytest.mark.slow
def test_functionals_through_an_aberrated_pupil_are_within_the_noise_allowed(monkeypatch):
    monkeypatch.setattr(aberrated, "SHAPE", (26, 40))
    monkeypatch.setattr(basis, "BANDS_NM", np.arange(400.0, 701.0, 20.0))
    monkeypatch.setattr(basis, "PIXELS", 20)
    monkeypatch.setattr(basis, "ALLOWED", (0.1,))
    (work,) = aberrated.measured()
    assert "functionals" in marked(work, "default").setting  # they were tried
    # as in the stage `basis`
    assert marked(work, "default").error < 0.1 and marked(work, "peer").error < 1e-4


def test_denoised_paths_are_told_as_paths():
    plain = [(6, 0.4, 1.0, 0.0), (24, 0.2, 2.0, 0.0), (96, 0.1, 4.0, 0.0)]
    assert (
        denoise.as_paths(0.2, plain) == "24" and denoise.as_paths(0.2 / np.sqrt(2), plain) == "48"
    )
    # nothing is extrapolated beyond the measured errors
    assert denoise.as_paths(0.05, plain) == "more than 96" and denoise.as_paths(0.9, plain) == "6"
    # these errors are by chance in the wrong order
    assert denoise.as_paths(0.15, [(6, 0.1, 1.0, 0.0), (24, 0.2, 2.0, 0.0)]) == "14"
    given = denoise.points(
        [*plain, (None, 0.11, 3.5, 0.0)], [(6, 0.2, 1.5, 0.0)], [(6, 0.3, 1.2, 0.0)]
    )
    assert [p.setting for p in given] == [
        "6 paths",
        "24 paths",
        "96 paths",
        "to a noise of 0.1",
        "6 paths, denoised: as 24",
        "6 paths, common rule",
    ]
    assert [p.mark for p in given] == ["", "", "", "default", "view", "peer"]


def test_dots_that_lie_together_share_a_text_and_others_do_not():
    pixels = np.array([[100.0, 50], [104, 52], [400, 50], [112, 55], [100, 300]])
    assert sorted(map(sorted, diagram.together(pixels))) == [[0, 1, 3], [2], [4]]
    assert (
        diagram.overlap((0, 0, 2, 2), (1, 1, 3, 3)) == 1
        and diagram.overlap((0, 0, 1, 1), (2, 0, 3, 1)) == 0
    )
    assert diagram.outside((0, 0, 2, 1), (1, 0, 5, 5)) == 1


@pytest.mark.slow
def test_a_stage_with_several_diagrams_is_one_picture(tmp_path, monkeypatch):
    from PIL import Image

    points = [
        Point("good", 1e-3, 2.0, mark="default"),
        Point("peer", 0.1, 1.0, mark="peer"),
        Point("exact", 0.0, 9.0),
        Point("fails", np.inf, 0.5),
    ]
    works = [
        Work(f"part {k}", "relative error", "closed form", error, points)
        for k, error in enumerate((1e-2, 1e-16, np.nan))
    ]
    monkeypatch.setattr("isethdr_measured.accuracy.dynamics.measured", lambda: works)
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    rows = accuracy.accuracy(stage="dynamics", pictures=str(pictures))
    assert len(rows) == 12
    (path,) = pictures.iterdir()
    assert path.name == "accuracy_dynamics.png" and path.stat().st_size < 120_000
    wide, high = Image.open(path).size
    assert wide == round(diagram.WIDTH_IN * diagram.DPI) and high < 1.2 * wide
