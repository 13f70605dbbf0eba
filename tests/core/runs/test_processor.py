"""The kernels that libraries choose for a processor are recorded with every run and scene. They are
not part of a key.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from dataclasses import dataclass

import pytest
from isethdr_catalog.commands import catalog
from typer.testing import CliRunner

from isethdr_core import compose, run
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.processor import kernels
from isethdr_core.runs.run import run_key

SHOWN = "import json; from isethdr_core.runs.processor import kernels; print(json.dumps(kernels()))"


@dataclass(frozen=True)
class Compiles:
    """A component with a compiler of its own."""

    def kernels(self) -> dict[str, str]:
        """Return its compiler."""
        return {"compiler": "LLVM 19"}


def test_processor_libraries_and_components_are_named():
    found = kernels(Compiles(), object(), None)
    assert found["processor"].startswith(platform.machine())
    assert found["numpy"] and found["compiler"] == "LLVM 19"
    assert any(name.startswith("blas in ") for name in found)
    assert not any(os.sep in name for name in found), "no path of this machine"


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names kernels of x86-64")
def test_another_choice_of_the_libraries_is_another_record():
    """The variables make the libraries choose kernels as on a processor with fewer features."""
    smaller = {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    }
    code = [sys.executable, "-c", SHOWN]
    there = json.loads(
        subprocess.run(code, env=os.environ | smaller, capture_output=True, check=True).stdout
    )
    here = kernels()
    blas = [name for name in there if name.startswith("blas in ")]
    assert blas and all(there[name].endswith("Nehalem") for name in blas)
    assert "X86_V4" not in there["numpy"].split()
    assert there["processor"] == here["processor"]


def test_a_run_records_and_shows_them_and_its_key_does_not_depend_on_them(
    isethdr_home, monkeypatch
):
    config = compose(
        [
            "scene=uniform",
            "scene.width=8",
            "scene.height=6",
            "scene.horizontal_field_deg=4",  # makes the sensor small
            "lens=ideal",
            "sensor=ideal",
            "draws=1",
            "~renderer",
            "~versions",
            "~flare@flare.dirt",
            "~metric.ssim",
            "report=false",
        ]
    )
    key = run_key(config, chain(config))
    monkeypatch.setattr("isethdr_core.runs.run.kernels", lambda *_: {"processor": "another one"})
    result = run(config)
    assert result.key == key and result.attributes["kernels"] == {"processor": "another one"}
    monkeypatch.setenv("ISETHDR_HOME", str(isethdr_home))
    assert '"processor": "another one"' in CliRunner().invoke(catalog, ["show", key]).output
