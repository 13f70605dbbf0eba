"""The command line and Python do the same; stored results are not computed again; `plan` computes
nothing.
"""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from isethdr_core import compose, run
from isethdr_core.cli.commands import app
from isethdr_core.pipeline.chain import camera_stages

from .command import FAST, LIGHTS, isethdr, stores

WITHOUT_LABELS = ["scene=uniform", *FAST, "lighting=ideal", "sensor=bayer"]


@pytest.mark.slow
def test_the_command_and_python_name_the_same_run(isethdr_home, monkeypatch):
    config = compose(WITHOUT_LABELS)
    run(config)
    made = stores(isethdr_home)

    def refused(*_):
        raise AssertionError("a stage of the chain ran")

    monkeypatch.setattr(camera_stages, "stage", refused)
    result = run(config)
    assert not result.computed and {result.path.name} == made.keys() == stores(isethdr_home).keys()
    again = isethdr("run", *WITHOUT_LABELS)
    assert "already computed" in again.stdout and stores(isethdr_home) == made
    # a scene without labels has no objects: their metric gives no row, and the ledger says so
    [row] = [r for r in result.ledger if r.stage.startswith("metric contrast")]
    assert "no label 'instance'" in row.left_out[0].why and not [
        s for s in result.scores if s["metric"] == "object_contrast"
    ]


def test_plan_computes_nothing(isethdr_home):
    done = CliRunner().invoke(
        app, ["plan", *LIGHTS, "lighting=weights", "+lighting.weights.sky=1", "sensor=rgbw"]
    )
    assert (
        done.exit_code == 0
        and "light groups  sky" in done.stdout
        and "labels        instance" in done.stdout
    )
    assert not isethdr_home.exists()


@pytest.mark.slow
def test_the_plan_of_the_main_job_loads_no_renderer(isethdr_home):
    code = (
        "import sys\nfrom isethdr_core.cli.plan_summary import"
        " print_plan\nprint_plan([])\nprint(sorted({'mitsuba', 'drjit', 'matplotlib', 'skimage',"
        " 'colour'} & {m.split('.')[0] for m in sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (
        "cameras       bayer, split_pixel, rgbw" in done.stdout and "nothing stored" in done.stdout
    )
    assert done.stdout.splitlines()[-1] == "[]" and not isethdr_home.exists()
