"""The doctor, the fall-back without LLVM, and what a beginner does wrong."""

import json

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba import doctor
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError


def test_the_scalar_way_renders_the_same_scene(make):
    """Sky and lamps, labels and footprint, without LLVM."""
    scene = make.street(2)
    settings = {"width": 16, "height": 9, "margin": 0.0, "max_depth": 3, "first_nm": 450.0, "last_nm": 650.0, "step_nm": 40.0}
    demand = Demand(groups=("sky", "streetlights"), labels=frozenset({"instance", "distance"}))
    slow = MitsubaRenderer(**settings, variant="scalar", samples=256)(scene, demand)
    fast = MitsubaRenderer(**settings, samples=1024)(scene, demand)
    assert slow.radiance.dims == fast.radiance.dims and np.array_equal(slow.wavelength, fast.wavelength)
    # rays of different compilers may fall on either side of an edge: one tile of 144
    assert (slow.instance.values != fast.instance.values).sum() <= 1
    for group, tolerance in (("sky", 0.02), ("streetlights", 0.05)):
        a, b = (ds.radiance.sel(light_group=group).mean("wavelength").values for ds in (slow, fast))
        # 256 paths a tile leave some per cent of noise per tile; the median over tiles has a tenth of that
        lit = b > 0.01 * b.mean()
        assert np.median(a[lit] / b[lit]) == pytest.approx(1, abs=tolerance)
        assert a.mean() == pytest.approx(b.mean(), rel=2 * tolerance)


def test_the_scalar_way_needs_square_tiles(make):
    with pytest.raises(ConfigError, match="square tiles"):
        MitsubaRenderer(width=16, height=16, variant="scalar")(make.street(1))


def test_a_variant_that_aborts_is_found_out_in_a_child(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(doctor, "PROBE", "import os, sys\nif 'llvm' in sys.argv[1]: os.abort()\nif 'cuda' in sys.argv[1]: sys.exit('no card')")
    doctor.doctor.cache_clear()
    try:
        found = doctor.doctor()
        assert found["scalar"] == "works" and found["llvm"].startswith("exit status -6") and "no card" in found["cuda"]
        assert doctor.choose_variant("auto") == "scalar_spectral"
        with pytest.raises(ConfigError, match="libllvm19"):
            doctor.choose_variant("llvm")
        # kept, so that the next process need not try again
        assert json.loads((tmp_path / "isethdr" / "mitsuba_variants.json").read_text())["found"] == found
    finally:
        doctor.doctor.cache_clear()


def test_doctor_says_what_works(capsys):
    doctor.doctor_command()
    assert "mitsuba 3." in capsys.readouterr().out


def test_mistakes_are_answered_with_what_to_type(make):
    scene = make.describe([], sky=make.flat(1.0))
    for settings, demand, message in (({"width": 0}, None, "width"), ({"margin": -0.1}, None, "margin"), ({"step_nm": 0.0}, None, "step_nm"),
                                      ({"samples": 0}, None, "samples"), ({}, Demand(groups=("streetlight",)), "no light group")):
        with pytest.raises(ConfigError, match=message):
            MitsubaRenderer(**settings)(scene, demand)
    with pytest.raises(ConfigError, match="no light"):
        MitsubaRenderer()(make.describe([]))


def test_importing_the_plugin_imports_nothing_heavy():
    import subprocess
    import sys

    code = "import sys, isethdr_mitsuba; assert not {'mitsuba', 'drjit', 'xarray', 'scipy', 'numpy'} & set(sys.modules), sorted(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
