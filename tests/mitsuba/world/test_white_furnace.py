"""White furnace: surfaces without absorption reflect all light, or they state their loss."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.world.coat_energy import coat_energy, lost_light
from isethdr_mitsuba.world.compensated_surface import mean_over_hemisphere
from isethdr_scenes.materials import MATERIALS

from isethdr_core.errors import ConfigError
from isethdr_core.scene import Material, flat

from .bsdf_probe import albedo, chi_square_above_p, reciprocity, samples_agree

ANGLES_DEG = (0.0, 30.0, 60.0, 80.0, 85.0)
MATT_METAL = ("conductor", 0.8, 1.5)  # Mitsuba's plugin reflects only 0.64 at 85 degrees
ROUGH = sorted(
    {
        (m.kind, m.roughness, m.index)
        for m in MATERIALS.values()
        if m.kind in ("plastic", "conductor") and m.roughness > 0
    }
)


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def loaded(kind, roughness, index):
    """Return the BSDF of a white surface."""
    from isethdr_mitsuba.world.materials import surface

    return mi.load_dict(surface(Material("w", kind, flat(1.0), roughness, index), 400.0, 700.0))


def furnace(kind, roughness, index):
    """Return the albedo of a white surface at ANGLES_DEG from the normal."""
    bsdf = loaded(kind, roughness, index)
    return np.array([albedo(bsdf, 90 - a, 40_000) for a in ANGLES_DEG])


def scalar_albedo(bsdf, angle_deg, count):
    """Return the albedo at an angle from the normal, by single samples of the scalar variant."""
    rng = np.random.default_rng(2)
    si = mi.SurfaceInteraction3f()
    a = np.radians(angle_deg)
    si.wi = mi.Vector3f(np.sin(a), 0.0, np.cos(a))
    si.wavelengths = mi.Spectrum(550.0)
    draw = lambda: bsdf.sample(mi.BSDFContext(), si, rng.random(), mi.Point2f(*rng.random(2)))
    return float(np.mean([draw()[1][0] for _ in range(count)]))


def between(material):
    """Return whether there are both a smoother and a rougher material of the same kind."""
    of_kind = [other for other in ROUGH if other[0] == material[0]]
    return of_kind[0] < material < of_kind[-1]


@pytest.mark.parametrize(
    "kind, roughness, index",
    [
        *(pytest.param(*m, marks=[pytest.mark.slow] * between(m)) for m in ROUGH),
        ("plastic", 0.55, 1.5),
        MATT_METAL,
    ],
)
def test_a_white_surface_sends_back_its_light(kind, roughness, index):
    found = furnace(kind, roughness, index)
    # required: 0.98 to 1.00; the noise of 40,000 paths is 0.001
    assert found.min() > 0.99 and found.max() < 1.002


@pytest.mark.parametrize("kind, roughness", [("conductor", 0.8), ("plastic", 0.3)])
def test_a_compensated_surface_is_reciprocal_and_sampled_as_it_is_evaluated(kind, roughness):
    """Reciprocity, sampling weights, and a chi-square test of sampled directions.

    By chance, p is below 1e-4 once in 10,000 seeds; the seed is fixed.
    """
    bsdf = loaded(kind, roughness, 1.5)
    assert reciprocity(bsdf, 20_000) < 2e-3  # float32; tables of roughplastic: 4e-4
    assert max(samples_agree(bsdf, 30.0, 20_000)) < 2e-3
    # at a low elevation, where the lobe is strongest
    assert chi_square_above_p(bsdf, 20.0, 30_000, order=4) > 1e-4


def test_without_loss_nothing_is_added():
    missing = np.zeros(33)
    assert mean_over_hemisphere(missing) == 0
    assert mean_over_hemisphere(missing + 0.3) == pytest.approx(0.3, rel=1e-12)
    # the mean of 1 - c is 1/3; 2e-3 since the table is linear in the root of c
    assert mean_over_hemisphere(1 - np.linspace(0, 1, 33) ** 2) == pytest.approx(1 / 3, rel=2e-3)


def test_the_scalar_variant_states_its_loss():
    mi.set_variant("scalar_spectral")
    albedo_85 = scalar_albedo(loaded("plastic", 0.55, 1.5), 85.0, 2000)
    assert albedo_85 == pytest.approx(coat_energy("plastic", 0.55).least, abs=0.03)  # 2000 paths


def test_what_a_scene_loses_is_that_of_its_worst_surface():
    smooth = Material("smooth", "plastic", flat(0.1), 0.02)
    rough = Material("rough", "plastic", flat(0.8), 0.55)
    matt = Material("matt", "diffuse", flat(0.9))
    lost, name = lost_light([smooth, rough, matt])
    assert name == "rough" and lost == 1 - coat_energy("plastic", 0.55).least > 0.02
    assert lost_light([matt]) == (0.0, "")


def test_an_unknown_kind_is_refused(make):
    from isethdr_mitsuba.world.materials import ramp_surfaces

    scene = make.describe([], materials=[make.material("wall", "difuse")])
    with pytest.raises(ConfigError, match="'wall' has the unknown kind 'difuse'; did you mean"):
        ramp_surfaces(scene)
