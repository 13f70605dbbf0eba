"""The doctor, and typical mistakes of beginners."""

import json
import subprocess
import sys

import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba import doctor
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError


def test_a_variant_that_aborts_is_found_out_in_a_child(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(
        doctor,
        "PROBE",
        "import os, sys\nif 'llvm' in sys.argv[1]: os.abort()\nif 'cuda' in sys.argv[1]:"
        " sys.exit('no card')",
    )
    doctor.doctor.cache_clear()
    try:
        found = doctor.doctor()
        assert (
            found["scalar"] == "works"
            and found["llvm"].startswith("exit status -6")
            and "no card" in found["cuda"]
        )
        assert doctor.choose_variant("auto") == "scalar_spectral"
        with pytest.raises(ConfigError, match="libllvm19"):
            doctor.choose_variant("llvm")
        # the result is stored, so that the next process does not try again
        assert (
            json.loads((tmp_path / "isethdr" / "mitsuba_variants.json").read_text())["found"]
            == found
        )
    finally:
        doctor.doctor.cache_clear()


def test_doctor_says_what_works(capsys):
    doctor.doctor_command()
    assert "mitsuba 3." in capsys.readouterr().out


def test_mistakes_are_answered_with_what_to_type(make):
    scene = make.describe([], sky=make.flat(1.0))
    for settings, demand, message in (
        ({"width": 0}, None, "width"),
        ({"margin": -0.1}, None, "margin"),
        ({"step_nm": 0.0}, None, "step_nm"),
        ({"samples": 0}, None, "samples"),
        ({"error_allowed": 1.5}, None, "error_allowed"),
        ({}, Demand(groups=("streetlight",)), "no light group"),
    ):
        with pytest.raises(ConfigError, match=message):
            MitsubaRenderer(**settings)(scene, demand)
    with pytest.raises(ConfigError, match="no light"):
        MitsubaRenderer()(make.describe([]))


def test_importing_the_plugin_imports_nothing_heavy():
    import subprocess
    import sys

    code = (
        "import sys, isethdr_mitsuba; assert not {'mitsuba', 'drjit', 'xarray', 'scipy', 'numpy'} &"
        " set(sys.modules), sorted(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
def test_the_renderer_names_its_compiler_where_it_rendered():
    """The variant is recorded with each scene, since the last bits depend on it."""
    code = (
        "from isethdr_mitsuba.renderer import MitsubaRenderer as R; print(R().kernels()); import"
        " mitsuba as mi;mi.set_variant('scalar_spectral'); print(R().kernels())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["{}", "{'mitsuba': 'scalar_spectral'}"]
