"""Road surfaces as Mitsuba evaluates them: figures of the CIE tables, R_L, energy, sampling."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_scenes.road_photometry import (
    figures,
    r_table,
    retro_luminance,
    weighted_difference,
)
from isethdr_scenes.road_surfaces import asphalt, marking, road_surfaces

from .bsdf_probe import (
    albedo,
    chi_square_above_p,
    chi_square_p,
    reciprocity,
    samples_agree,
    towards,
    value,
)

NAMES = tuple(road_surfaces())
# Q0 and S1 published for the class: van Bommel, Road Lighting, tables 12.2 and 12.3. S1 of C
# classes and R1 to R4 is that of the r-table.
PUBLISHED = {
    "r1": (0.10, 0.25),
    "r2": (0.07, 0.58),
    "r3": (0.07, 1.11),
    "r4": (0.08, 1.55),
    "c1": (0.10, 0.24),
    "c2": (0.07, 0.97),
    "w1": (0.114, None),
    "w2": (0.150, None),
    "c2w3": (0.196, None),
    "c2w4": (0.247, None),
}
# limits of S1, from the same source
S1_LIMITS = {"w1": (0, 4.5), "w2": (4.5, 7.2), "c2w3": (7.2, 9.8), "c2w4": (9.8, 12.0)}
# borders of rings in 1 - cos(angle from the observer)
RINGS = np.r_[0, np.geomspace(1e-4, 1.99, 24)]


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def loaded(material):
    from isethdr_mitsuba.world.materials import surface

    return mi.load_dict(surface(material, 400.0, 700.0))


@cache
def road(name):
    """Return a road surface, loaded once for all tests, which use the same variant."""
    return loaded(asphalt(name))


def law(bsdf):
    return lambda light, observer: value(bsdf, light, observer)


@pytest.mark.parametrize("name", NAMES)
def test_figures_are_those_of_the_table(name):
    found = figures(r_table(law(road(name))))
    told = road_surfaces()[name]
    assert found.q0 == pytest.approx(told.q0, rel=0.10)
    assert found.s1 == pytest.approx(told.s1, rel=0.10)
    assert found.s2 == pytest.approx(told.s2, rel=0.10)
    # 2 %: evaluated at 550 nm, where the reflectance of asphalt is 1 % below its luminous mean
    assert retro_luminance(law(road(name))) == pytest.approx(told.r_l, rel=0.02)


@pytest.mark.parametrize("name", sorted(PUBLISHED))
def test_figures_are_those_of_the_published_class(name):
    found = figures(r_table(law(road(name))))
    q0, s1 = PUBLISHED[name]
    assert found.q0 == pytest.approx(q0, rel=0.10)
    if s1 is not None:
        assert found.s1 == pytest.approx(s1, rel=0.10)
    least, most = S1_LIMITS.get(name, (0, np.inf))
    assert least < found.s1 < most


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ("damp", "w1", "w2")])
def test_the_r_table_is_met_cell_by_cell(name):
    """Compare with the r-tables of the CIE, cell by cell.

    The tables are not part of this project; they are read from the folder that ISETHDR_REFERENCE
    names.
    """
    file = Path(os.environ.get("ISETHDR_REFERENCE", "")) / "r_tables" / f"{name.upper()}.txt"
    if not file.is_file():
        pytest.skip(f"no r-table {file}; ISETHDR_REFERENCE names a folder with r_tables/R1.txt ...")
    assert weighted_difference(r_table(law(road(name))), np.loadtxt(file)) < 0.20


def test_dry_roads_send_back_more_than_wet_ones():
    r_l = {name: retro_luminance(law(road(name))) for name in NAMES}
    for name in ("r1", "r2", "r3", "r4", "c1", "c2"):
        assert 5 < r_l[name] < 20  # mcd m-2 lx-1, typical of dry roads
    assert r_l["c2"] > r_l["damp"] > r_l["w1"] > r_l["w2"] > r_l["c2w3"] > r_l["c2w4"] > 0.5


@pytest.mark.parametrize("r_l", [35.0, 100.0, 150.0, 300.0])
def test_a_marking_has_the_r_l_it_was_asked_for(r_l):
    bsdf = loaded(marking(r_l))
    assert retro_luminance(law(bsdf)) == pytest.approx(r_l, rel=0.02)
    # lamps are 0.65 m high, the eye 1.2 m; the class is measured at 30 m, but roads are seen at 15
    # to 50 m
    at = lambda metres: np.degrees(np.arctan(np.array([0.65, 1.2]) / metres))
    near_and_far = [retro_luminance(law(bsdf), *at(metres)) for metres in (15, 20, 40, 50)]
    np.testing.assert_allclose(near_and_far, r_l, rtol=0.15)


@pytest.mark.parametrize("name", ["c2", "c2w4", "marking"])
def test_a_road_is_reciprocal_and_sampled_as_it_is_evaluated(name):
    bsdf = loaded(marking(150.0)) if name == "marking" else road(name)
    assert reciprocity(bsdf) < 3e-4  # float32 at grazing angles
    for elevation_deg in (1.0, 30.0):
        assert max(samples_agree(bsdf, elevation_deg)) < 1e-3
        assert 0.02 < albedo(bsdf, elevation_deg) < 0.7


@pytest.mark.parametrize("name", NAMES)
def test_no_road_reflects_more_than_its_light(name):
    for elevation_deg in (0.5, 2.29, 10.0, 90.0):
        assert albedo(road(name), elevation_deg, 20_000) < 0.6


def chi_square(name, elevation_deg, samples, order):
    """Return the p value of samples: of a road on a grid over the hemisphere, of a marking in
    rings about the observer, towards whom its glass beads reflect.
    """
    if name == "marking":
        bsdf = loaded(marking(150.0))
        return chi_square_p(bsdf, towards(elevation_deg), RINGS, samples, order=order)
    return chi_square_above_p(road(name), elevation_deg, samples, order=order)


@pytest.mark.parametrize("name, elevation_deg", [("c2", 2.29), ("c2w4", 45.0), ("marking", 2.29)])
def test_directions_are_drawn_as_the_density_says(name, elevation_deg):
    """Sampled directions have the stated density, by a chi-square test.

    By chance, p is below 1e-4 once in 10,000 seeds; the seed is fixed.
    """
    assert chi_square(name, elevation_deg, 50_000, 6) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, "marking"])
@pytest.mark.parametrize("elevation_deg", [1.0, 2.29, 10.0, 45.0])
def test_directions_are_drawn_as_the_density_says_everywhere(name, elevation_deg):
    """Repeat the chi-square test for all road surfaces and elevations, with more samples."""
    assert chi_square(name, elevation_deg, 1_000_000, 10) > 1e-4
