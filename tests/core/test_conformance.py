"""Every installed component keeps every promise of its kind."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from isethdr_core.plugins.registry import broken_plugins, components
from isethdr_core.testing import check

# fields that make a component quick; none of them switches an effect off
QUICK = {
    ("flare", "ghosts"): {"prescription": "singlet"},
    # small pupils have small kernels
    ("lens", "diffraction_limited"): {"f_number": 8.0},
    ("lens", "wavefront"): {"f_number": 8.0},
    ("lens", "prescription"): {"error_allowed": 0.3},
    ("renderer", "mitsuba"): {"width": 32, "height": 18, "samples": 16, "step_nm": 50.0},
    ("scene", "night_drive"): {
        "vehicles": (1, 1),
        "people": (1, 1),
        "animals": (1, 1),
        "trees": (1, 1),
        "street_lamps": (1, 1),
    },
    ("scene", "luminance_ramp"): {"width": 64, "height": 36},
    ("scene", "point_lights"): {"width": 64, "height": 36},
    ("scene", "macbeth"): {"width": 64, "height": 36},
    ("scene", "street"): {"road": "yard", "people_per_km": 10.0, "parked_share": 0.2},
}
# components that only the slow tests check: other tests cover their contracts, or the quick tests
# check a component with the same base class
DEAR = {
    ("flare", "ghosts"),
    ("flare", "windscreen"),
    ("lens", "diffraction_limited"),
    ("lens", "prescription"),
    ("lens", "wavefront"),
    ("renderer", "mitsuba"),
    ("scene", "night_drive"),
    ("scene", "street"),
    ("scene", "tunnel"),
    ("sensor", "interleaved"),
    ("sensor", "lin_log"),
    ("sensor", "lofic"),
    ("sensor", "rgbw"),
    ("sensor", "single"),
    ("sensor", "staggered"),
}
NEEDS = {("renderer", "mitsuba"): "mitsuba"}
NOT_HERE = {
    ("scene", "iset_exr"): "reads a folder of EXR files, of which none is part of this project",
    ("scene", "file"): "reads a user's file; tests/scenes/test_picture_file.py checks it with one",
    (
        "scene",
        "stored",
    ): "reads the home folder; tests/scenes/test_stored.py checks it with a store",
    ("scene", "array"): "the same class as scene file",
    ("isp", "network"): "reads a user's model; tests/isp/network checks it with one",
}


@pytest.fixture
def small_table(tmp_path):
    """Write the table of a measured lens, and return its path. Point spread functions are wider at
    the border and for red.
    """
    psf = np.zeros((2, 2, 5, 5))
    psf[..., 2, 2] = 8.0
    beside = np.array([[[0.5], [1.0]], [[1.0], [2.0]]])
    psf[..., 2, [1, 3]] = beside
    psf[..., [1, 3], 2] = beside
    path = tmp_path / "small.npz"
    angles = {"pitch_um": 20.0, "field_deg": [0.0, 12.0], "wavelength_nm": [400.0, 700.0]}
    np.savez(path, psf=psf, **angles)
    return str(path)


@pytest.mark.parametrize(
    ("kind", "name"),
    [pytest.param(*c, marks=[pytest.mark.slow] * (c in DEAR)) for c in sorted(components())],
    ids=lambda part: part,
)
def test_component_keeps_its_promises(kind, name, small_table):
    if (kind, name) in NOT_HERE:
        pytest.skip(NOT_HERE[kind, name])
    if (library := NEEDS.get((kind, name))) and not find_spec(library):
        pytest.skip(f"{library} is not installed; pip install isethdr[{library}]")
    fields = QUICK.get((kind, name), {})
    if (kind, name) == ("lens", "measured"):
        fields = {"table": small_table}
    check(kind, name, **fields)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diffraction_limited", "measured", "wavefront"])
def test_bundled_lenses_keep_their_promises_as_they_come(name):
    check("lens", name)


def test_no_bundled_plugin_is_broken():
    assert broken_plugins() == ()


def test_tables_above_name_components_that_exist():
    assert (QUICK.keys() | NEEDS.keys() | NOT_HERE.keys()) <= components().keys()


def test_every_kind_has_an_ideal_member_or_needs_none():
    have = {kind for kind, name in components() if name == "ideal"}
    # a scene and a renderer have no effects to switch off
    assert have >= {"lighting", "lens", "flare", "sensor", "isp", "metric"}
