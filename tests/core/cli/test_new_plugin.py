"""`isethdr new-plugin`: packages of every kind pass their tests and ruff, and can be run."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys

import pytest

from isethdr_core.cli.new_plugin import make_plugin, print_new_plugin
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.component import KINDS

from ..command_line import isethdr

# tests that run quickly; the slow test also composes the presets and images the flare by a lens
QUICK = "not preset and not contract_of_a_flare"
RUN_TESTS = "import pytest, sys; sys.exit(pytest.main(sys.argv[1:]))"
PYTEST = ("--disable-plugin-autoload", "-q", "-p", "no:cacheprovider")


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Make a package of each kind, and copy its modules to `site` as pip would install them."""
    folder = tmp_path_factory.mktemp("packages")
    for kind in KINDS:
        name = f"acme_{kind}"
        made = make_plugin(kind, name, folder)
        shutil.copytree(made / name, folder / "site" / name)
        info = folder / "site" / f"{name}-0.1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
        pyproject = (made / "pyproject.toml").read_text()
        [(entry, module)] = re.findall(
            r"^\[project\.entry-points\.isethdr\]\n(\w+) = \"(\w+)\"$", pyproject, re.MULTILINE
        )
        (info / "entry_points.txt").write_text(f"[isethdr]\n{entry} = {module}\n")
    return folder


@pytest.mark.slow
def test_packages_of_every_kind_keep_their_promises(packages):
    done = isethdr(
        *PYTEST,
        "--rootdir",
        str(packages),
        "-k",
        QUICK,
        *(str(packages / f"acme-{kind}" / "tests") for kind in KINDS),
        code=RUN_TESTS,
        plugins=[packages / "site"],
    )
    assert done.returncode == 0, done.stdout
    # tests of seven conformance kits, and at least one test of a law for each kind
    assert int(re.search(r"(\d+) passed", done.stdout).group(1)) >= 7 + len(KINDS)


def test_packages_of_every_kind_are_clean(packages):
    for command in (["check", "--select", "E,W,F,I,B,UP"], ["format", "--check"]):
        clean = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--isolated", "--line-length", "100", "."],
            cwd=packages,
            capture_output=True,
            text=True,
            check=False,
        )
        assert clean.returncode == 0, clean.stdout
    for path in packages.glob("acme-*/**/*.md"):
        assert all(len(line) <= 100 for line in path.read_text().splitlines()), path


@pytest.mark.parametrize(
    ("kind", "name", "message"),
    [
        ("sensr", "acme_mono", "unknown kind 'sensr'; did you mean 'sensor'"),
        ("sensor", "2mono", "cannot be that of a Python package; expected lower-case letters"),
        ("sensor", "acme-mono", "cannot be that of a Python package"),
        ("sensor", "AcmeMono", "cannot be that of a Python package"),
        ("sensor", "_mono", "cannot be that of a Python package"),
        ("sensor", "mono_", "cannot be that of a Python package"),
        ("sensor", "lambda", "cannot be that of a Python package"),
        ("sensor", "größe", "cannot be that of a Python package"),
        (
            "sensor",
            "null",
            "cannot be chosen, because sensor=null on the command line sets a value",
        ),
        ("lens", "nan", "cannot be chosen, because lens=nan on the command line sets a value"),
        ("sensor", "", "cannot be that of a Python package"),
        ("sensor", "bayer", "'bayer' is offered by isethdr_sensors already; expected a new name"),
        ("sensor", "bayer_imx363", "is already the name of a preset of kind sensor; expected a"),
        ("sensor", "numpy", "a Python module 'numpy' is installed already; expected a new name"),
        ("sensor", "isethdr_sensors", "a Python module 'isethdr_sensors' is installed already"),
    ],
)
def test_a_wrong_name_is_one_line(tmp_path, kind, name, message):
    with pytest.raises(ConfigError, match=re.escape(message)) as raised:
        make_plugin(kind, name, tmp_path)
    assert "\n" not in str(raised.value) and not list(tmp_path.iterdir())


def test_an_existing_folder_is_left_as_it_is(tmp_path):
    kept = tmp_path / "acme-mono" / "notes.txt"
    kept.parent.mkdir()
    kept.write_text("mine")
    with pytest.raises(ConfigError, match="acme-mono exists already; expected a new folder"):
        make_plugin("sensor", "acme_mono", tmp_path)
    assert list(tmp_path.rglob("*")) == [kept.parent, kept]


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(ConfigError, match=r"cannot write .*acme-mono .*; expected a folder"):
        make_plugin("sensor", "acme_mono", tmp_path / "file")


def test_what_to_type_next_is_printed(tmp_path, capsys):
    print_new_plugin("lens", "acme_pinhole", tmp_path / "new")
    shown = capsys.readouterr().out
    assert f"\n  pip install -e '{tmp_path / 'new' / 'acme-pinhole'}[test]'\n" in shown
    assert "\n  acme_pinhole/conf/lens/acme_pinhole_f4.yaml\n" in shown
    assert "\n  isethdr plugins lens acme_pinhole\n" in shown


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_plugin_is_made_installed_tested_and_run(kind, tmp_path, isethdr_home):
    """Take the steps of a plugin author. pip needs no network, because hatchling is installed."""
    pytest.importorskip("hatchling")
    name = f"acme_{kind}"
    made = isethdr("new-plugin", kind, name, "--into", str(tmp_path))
    assert made.returncode == 0, made.stderr
    folder = tmp_path / f"acme-{kind}"
    site = tmp_path / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--no-build-isolation", "--target", str(site)]
    subprocess.run([*pip, *options, str(folder)], check=True)
    tested = isethdr(*PYTEST, str(folder / "tests"), code=RUN_TESTS, plugins=[site])
    assert tested.returncode == 0, tested.stdout
    listed = isethdr("plugins", kind, name, "--strict", plugins=[site])
    assert listed.returncode == 0 and not listed.stderr
    readme = (folder / "README.md").read_text()
    [command] = re.findall(r"^    isethdr (run .*?)\n\n", readme, re.MULTILINE | re.DOTALL)
    words = shlex.split(command.replace("\\\n", " "))
    done = isethdr(*words, "report=false", plugins=[site])
    assert done.returncode == 0, done.stderr
    [store] = (isethdr_home / "runs").glob("*.zarr")
    assert f'"{name}"' in (store / "zarr.json").read_text()  # in the run's config
    taken = isethdr("new-plugin", kind, name, "--into", str(tmp_path / "again"), plugins=[site])
    assert taken.returncode == 2 and taken.stderr.startswith("error: ")
    assert f"{name!r} is offered by {name} already" in taken.stderr
