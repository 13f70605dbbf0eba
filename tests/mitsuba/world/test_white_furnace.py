"""White furnace: without absorption, surfaces reflect all light, or state their loss."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.world.coat_energy import coat_energy, lost_light
from isethdr_scenes.materials import MATERIALS

from isethdr_core.scene import Material, flat

from .bsdf_probe import albedo

ANGLES_DEG = (0.0, 30.0, 60.0, 80.0, 85.0)
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


def furnace(kind, roughness, index):
    """Albedo of the white surface at ANGLES_DEG from the normal."""
    from isethdr_mitsuba.world.materials import surface

    bsdf = mi.load_dict(surface(Material("w", kind, flat(1.0), roughness, index), 400.0, 700.0))
    return np.array([albedo(bsdf, 90 - a, 40_000) for a in ANGLES_DEG])


@pytest.mark.parametrize("kind, roughness, index", [*ROUGH, ("plastic", 0.55, 1.5)])
def test_a_white_surface_sends_back_its_light_or_the_loss_is_stated(kind, roughness, index):
    found = furnace(kind, roughness, index)
    assert found.max() < 1.002  # 40,000 paths: 0.001
    assert found[:2].min() > 0.97  # at 0 and 30 degrees; a third of it was lost at 0.55
    # 85 degrees is a node of the table; what lies between is no worse by more than its rounding
    assert found.min() > coat_energy(kind, roughness, index).least - 0.01


def test_what_a_scene_loses_is_that_of_its_worst_surface():
    smooth = Material("smooth", "plastic", flat(0.1), 0.02)
    rough = Material("rough", "plastic", flat(0.8), 0.55)
    matt = Material("matt", "diffuse", flat(0.9))
    lost, name = lost_light([smooth, rough, matt])
    assert name == "rough" and lost == 1 - coat_energy("plastic", 0.55).least > 0.02
    assert lost_light([matt]) == (0.0, "")
