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


def test_a_variant_that_hangs_does_not_work(monkeypatch):
    monkeypatch.setattr(doctor, "PROBE", "import time; time.sleep(60)")
    monkeypatch.setattr(doctor, "PROBE_S", 0.05)
    assert doctor._probe("cuda_ad_spectral") == "no result after 0.05 s"


def test_hiding_the_graphics_cards_tests_the_variants_again(monkeypatch, tmp_path):
    """A stored "works" of cuda would stop every rendering without a card."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cards = lambda: "works" if doctor.os.environ["CUDA_VISIBLE_DEVICES"] else "no card"
    monkeypatch.setattr(doctor, "_probe", lambda variant: cards() if "cuda" in variant else "works")
    try:
        for visible, chosen in (("0", "cuda_ad_spectral"), ("", "llvm_ad_spectral")):
            monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
            doctor.doctor.cache_clear()
            assert doctor.choose_variant("auto") == chosen
    finally:
        doctor.doctor.cache_clear()


def test_without_any_variant_auto_is_not_suggested(monkeypatch):
    found = {"mitsuba": "3.9.1", **dict.fromkeys(doctor.VARIANTS, "exit status 1")}
    monkeypatch.setattr(doctor, "doctor", lambda: found)
    with pytest.raises(ConfigError, match=r"force-reinstall 'isethdr\[mitsuba\]'`$"):
        doctor.choose_variant("auto")
    with pytest.raises(ConfigError, match="type renderer.variant=auto$"):
        doctor.choose_variant("llvm")


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


def test_more_light_groups_than_bits_are_refused(make):
    shapes = [
        make.part(make.quad(1, 1), "black", make.lamp("led", f"led{k}", 1.0, make.flat(1.0)))
        for k in range(33)
    ]
    scene = make.describe([("panel", "building", tuple(shapes), make.pose(5))])
    with pytest.raises(ConfigError, match="33 light groups .* at most 32"):
        MitsubaRenderer(width=2, height=2, samples=1, variant="llvm")(scene)


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
