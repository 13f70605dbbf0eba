"""A third-party package is installed from its own wheel, found, composed, checked and swept.
Nothing in isethdr is changed for it.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile

import pytest

from .command_line import EXAMPLE, isethdr


@pytest.fixture(scope="module")
def acme(tmp_path_factory):
    """Build the wheel from its pyproject.toml, and unpack it into a folder of its own, as an
    installer does. This needs no network.
    """
    pytest.importorskip(
        "hatchling", reason="the example plugin is built with hatchling; pip install isethdr[test]"
    )
    folder = tmp_path_factory.mktemp("acme")
    source = shutil.copytree(EXAMPLE, folder / "source")
    target = folder / "site"
    code = "import sys, hatchling.build; print(hatchling.build.build_wheel(sys.argv[1]))"
    built = subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        cwd=source,
        capture_output=True,
        text=True,
        check=True,
    )
    with zipfile.ZipFile(folder / built.stdout.split()[-1]) as wheel:
        wheel.extractall(target)
    return target


@pytest.mark.slow
def test_it_is_listed_with_its_package(acme):
    shown = isethdr("plugins", plugins=[acme])
    assert shown.returncode == 0 and not shown.stderr
    assert "acme_nano" in shown.stdout and "(acme_camera)" in shown.stdout
    assert "acme_plastic" in shown.stdout
    one = isethdr("plugins", "sensor", "acme_nano", plugins=[acme])
    words = " ".join(one.stdout.split())
    assert "Small sensor with shot and read noise" in words and "ramp" in words


COMPOSED = """
from isethdr_core import compose
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import chain
config = compose(["sensor=acme_nano", "sensor.dead_pixels=[[3,4],[5,6]]",
                  "lens=acme_plastic", "~flare.dirt"])
assert chain(config).cameras["acme_nano"].dead_pixels == ((3, 4), (5, 6))
assert compose(["sensor=acme_nano_night"]).sensor.exposure_s == 0.033
night = compose(["experiment=acme_night"])
assert night.seed == 7 and night.sensor.name == "acme_nano" and night.lens.name == "acme_plastic"
for wrong, message in ((["sensor=acme_nano", "sensor.converter=flash"], "'ramp' or 'sar'"),
                       (["sensor=acme_nano", "sensor.dead_pixels=[[3,4,5]]"], "dead_pixels"),
                       (["sensor=acme_nan"], "did you mean 'acme_nano'"),
                       (["sensor=acme_nano_night", "sensor.exposure_s=long"], "exposure_s")):
    try:
        chain(compose(wrong))
    except ConfigError as err:
        assert message in str(err), err
    else:
        raise AssertionError(f"{wrong} was accepted")
print("composed")
"""
KEPT = """
from isethdr_core.testing import check
check("lens", "acme_plastic")
check("sensor", "acme_nano")
print("kept")
"""


def test_it_composes_with_types_presets_and_experiments(acme):
    used = isethdr(plugins=[acme], code=COMPOSED)
    assert used.stdout.split() == ["composed"], used.stderr


@pytest.mark.slow
def test_it_passes_the_conformance_kit(acme):
    used = isethdr(plugins=[acme], code=KEPT)
    assert used.stdout.strip().endswith("kept"), used.stderr


@pytest.mark.slow
def test_a_sweep_over_it_runs(acme, isethdr_home):
    # leave out the report: its plots take as long as all other steps together
    shown = isethdr(
        "run",
        "-m",
        "experiment=acme_night",
        "sensor=acme_nano,bayer",
        plugins=[acme],
        ISETHDR_PLUGINS="core,scenes,optics,sensors,isp,metrics,acme",
    )
    assert shown.returncode == 0, shown.stderr
    assert len(list((isethdr_home / "runs").glob("*.zarr"))) == 2
    assert "acme_nano" in shown.stdout and "bayer" in shown.stdout
