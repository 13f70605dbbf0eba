"""The documents agree with the code: hooks and their signatures, the tutorial's code, the words of
the glossary.
"""

from __future__ import annotations

import inspect
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from isethdr_core.cli.new_plugin import NewPlugin
from isethdr_core.component import KINDS
from isethdr_core.plugins import abilities, hookspecs
from isethdr_core.plugins.protocols import by_kind
from isethdr_core.plugins.registry import components
from isethdr_core.testing import check

from .source import ROOT

PLUGINS = (ROOT / "docs" / "how-to" / "plugins.md").read_text()
GLOSSARY = (ROOT / "docs" / "reference" / "glossary.md").read_text()
CONTRACTS = (ROOT / "docs" / "reference" / "contracts.md").read_text()
SENSOR_TUTORIAL = (ROOT / "docs" / "tutorials" / "sensor_plugin.md").read_text()
FIRST_RUN = (ROOT / "docs" / "tutorials" / "first_run.md").read_text()
SWEEP = (ROOT / "docs" / "tutorials" / "sweep.md").read_text()
# setting of a tutorial: settings of its test, which has fewer tiles and a small sensor
SMALLER = {
    "scene.width=160": ["scene.width=24"],
    "scene.height=90": ["scene.height=16", "scene.horizontal_field_deg=8"],
}
ISETHDR = "from isethdr_core.cli.commands import main; main()"
HOOKS = {name: spec for name, spec in vars(hookspecs).items() if name.startswith("isethdr_")}


@pytest.mark.parametrize("name", HOOKS)
def test_hooks_are_documented_with_their_signature(name):
    signature = f"{name}{inspect.signature(HOOKS[name])}".replace("'", "")
    assert f"### {signature}\n" in PLUGINS, f"plugins.md needs: ### {signature}"
    assert inspect.getdoc(HOOKS[name])


def test_no_hook_is_documented_that_does_not_exist():
    assert set(re.findall(r"\bisethdr_(?!core|camera)\w+", PLUGINS)) <= HOOKS.keys()


@pytest.mark.parametrize("name", HOOKS)
def test_every_hook_has_a_test(name):
    tests = re.findall(r"def (test_\w+)", (ROOT / "tests" / "core" / "test_hooks.py").read_text())
    assert any(name in test for test in tests), (
        f"tests/core/test_hooks.py needs a test with {name} in its name"
    )


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PLUGINS, re.DOTALL)


def tutorial(number):
    """Run number `number` of the code blocks that are a whole plugin, and return the component that
    the plugin offers.
    """
    whole = [b for b in blocks("python") if "class " in b and "isethdr_components" in b]
    scope = {"__name__": __name__}
    code = compile(whole[number], "docs/how-to/plugins.md", "exec", dont_inherit=True)
    exec(code, scope)  # noqa: S102
    globals()["Darkest"] = scope["Darkest"]  # where pickle looks for it
    [comp] = scope["isethdr_components"]()
    return comp


def test_the_ten_lines_work_and_the_kit_says_what_they_lack(offer):
    comp = tutorial(0)
    code = [
        line
        for line in blocks("python")[0].splitlines()
        if line.strip() and not line.strip().startswith('"""')
    ]
    assert len(code) == 10
    offer(comp.kind, comp.name, comp.cls)
    said = re.search(
        r"metric 'darkest' breaks the promise '[^']+': raised KeyError", " ".join(PLUGINS.split())
    ).group(0)
    with pytest.raises(AssertionError, match=re.escape(said)):
        check(comp.kind, comp.name)


@pytest.mark.filterwarnings("error::RuntimeWarning")  # such as a quantile of no pixels
def test_the_tutorials_second_version_keeps_every_promise(offer):
    comp = tutorial(1)
    offer(comp.kind, comp.name, comp.cls)
    check(comp.kind, comp.name)


def test_the_code_of_the_sensor_tutorial_is_that_of_a_new_plugin():
    """tests/core/cli/test_new_plugin.py checks that plugin; the slow test follows the page."""
    files = dict(NewPlugin("sensor", "acme_mono").files())
    code = re.findall(r"```python\n(.*?)```", SENSOR_TUTORIAL, re.DOTALL)
    assert code == [files["acme_mono/__init__.py"], files["acme_mono/sensor.py"]]
    [entry] = re.findall(r"```toml\n(.*?)```", SENSOR_TUTORIAL, re.DOTALL)
    assert entry in files["pyproject.toml"]
    listed = re.findall(r"^      (\S+)$", SENSOR_TUTORIAL, re.MULTILINE)
    assert listed == sorted(files)


@pytest.mark.slow
def test_the_sensor_tutorial_can_be_followed(tmp_path):
    """Every command of the page, in its order, in an empty folder."""
    commands = re.findall(r"^    ((?:isethdr|pip|pytest) .*(?:\n {8}.*)*)$", SENSOR_TUTORIAL, re.M)
    assert len(commands) == 6
    site = tmp_path / "site"
    variables = {"PYTHONPATH": f"{site}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    for command in commands:
        words = shlex.split(command.replace("\\\n", " "))
        if words[0] == "pip":  # without network, and not into the environment of the tests
            options = ["--quiet", "--no-deps", "--no-build-isolation", "--target", str(site)]
            words = [sys.executable, "-m", "pip", "install", *options, "./acme-mono"]
        elif words[0] == "pytest":
            words = [sys.executable, "-m", "pytest", "--disable-plugin-autoload", *words[1:]]
        else:
            words = [sys.executable, "-c", ISETHDR, *words[1:]]
        done = subprocess.run(
            words,
            cwd=tmp_path,
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    assert (tmp_path / "acme-mono" / "README.md").exists() and "snr_at_10" in done.stdout


def commands_of(page: str) -> list[list[str]]:
    """Return the words behind `isethdr` of each command that stands on lines of its own."""
    found = re.findall(r"^    isethdr (.*(?:\n {8}.*)*)$", page, re.MULTILINE)
    commands = [shlex.split(command.replace("\\\n", " ")) for command in found]
    return [[small for w in words for small in SMALLER.get(w, [w])] for words in commands]


def code_of(page: str) -> str:
    """Return the Python code of a tutorial, for the smaller scene of `commands_of`."""
    [code] = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    for typed, small in SMALLER.items():
        code = code.replace(f'"{typed}"', ", ".join(f'"{text}"' for text in small))
    return code


def in_folder(folder: Path, code: str, *words: str, exit_code: int = 0) -> str:
    """Run Python code in a folder, with its home below, and return what it prints.

    A command that has to fail returns what it says on standard error.
    """
    variables = {name: text for name, text in os.environ.items() if name != "ISETHDR_HOME"}
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=folder,
        env={**variables, "COLUMNS": "80"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == exit_code, f"{words}\n{done.stdout}{done.stderr}"
    return done.stderr if exit_code else done.stdout


def path_below(title: str, output: str) -> str:
    """Return the path that stands on the line below its title."""
    return re.search(rf"^{title}:\n(.*)$", output, re.MULTILINE)[1]


def keys_in(output: str) -> list[str]:
    """Return the keys of the runs whose paths `catalog find` lists."""
    return re.findall(r"^runs/runs/(\w+)\.zarr$", output, re.MULTILINE)


@pytest.mark.slow
def test_the_tutorial_of_the_first_run_can_be_followed(tmp_path):
    """Every command of the page and its code, in their order, in an empty folder."""
    chain, shorter, _, found = commands_of(FIRST_RUN)  # the third writes a file of the shell
    first, again, dark = (in_folder(tmp_path, ISETHDR, *w) for w in (chain, chain, shorter))
    assert first.startswith("ledger") and again.startswith("already computed")
    snr_db = re.compile(r"^snr_at_10 +dB +([\d.]+) ±", re.MULTILINE)
    assert float(snr_db.search(dark)[1]) < float(snr_db.search(first)[1])
    paths = [tmp_path / path_below(title, first) for title in ("store", "report")]
    assert paths[0].is_dir() and "<html" in paths[1].read_text()
    listed = keys_in(in_folder(tmp_path, ISETHDR, *found))
    assert listed == [Path(path_below("store", said)).stem for said in (dark, first)]

    for shell in re.findall(r"isethdr completion (\w+)", FIRST_RUN):
        assert "isethdr complete" in in_folder(tmp_path, ISETHDR, "completion", shell)
    for text in re.findall(r"`isethdr ((?:catalog|plugins|run --help)[^`]*)`", FIRST_RUN):
        words = text.replace("KEY", listed[0][:6]).split()
        assert in_folder(tmp_path, ISETHDR, *words), text
    said = in_folder(tmp_path, f"{code_of(FIRST_RUN)}\nassert not result.computed")
    brightest, noise = map(float, said.splitlines()[0].rpartition(")")[2].split())
    assert 0 < noise < brightest and "lens" in said


@pytest.mark.slow
def test_the_tutorial_of_a_sweep_can_be_followed(tmp_path):
    """Every command of the page and its code, in their order, in an empty folder."""
    sweep, parallel, best, tagged, sql, compare = commands_of(SWEEP)
    [error] = re.findall(r"^    (error: .*(?:\n    .*)*)$", SWEEP, re.MULTILINE)
    wrong = [word for word in sweep if not word.startswith(("name=", "sensor.exposure_s="))]
    wrong.append("sensor.exposure_s=-1,0.016")
    said = in_folder(tmp_path, ISETHDR, *wrong, exit_code=2)
    assert " ".join(error.split()) in " ".join(said.split())
    assert not (tmp_path / "runs" / "runs").exists(), "no job runs"

    done = in_folder(tmp_path, ISETHDR, *sweep)
    assert "4 computed" in done and "as good" in done
    assert "4 stored before" in in_folder(tmp_path, ISETHDR, *sweep)
    assert path_below("page", done) == "runs/sweeps/exposures/index.html"
    rows = (tmp_path / path_below("table", done)).read_text().splitlines()
    assert len(rows) == 1 + 4 and "ssim" in rows[0]
    chart = sweep[sweep.index("scene=macbeth") : sweep.index("sensor=bayer,rgbw")]
    assert "4 computed" in in_folder(tmp_path, ISETHDR, *parallel[:-1], *chart)

    listed = keys_in(in_folder(tmp_path, ISETHDR, *best))
    assert len(listed) == 4
    assert len(keys_in(in_folder(tmp_path, ISETHDR, *tagged))) == 2
    assert {"bayer", "rgbw"} <= set(in_folder(tmp_path, ISETHDR, *sql).split())
    compared = [*compare[:-2], listed[0][:4], listed[-1][:4]]
    assert "settings that differ" in in_folder(tmp_path, ISETHDR, *compared)
    printed = in_folder(tmp_path, f"{code_of(SWEEP)}\nassert not result.computed").splitlines()
    cameras = [tuple(line.split()[:2]) for line in printed]
    assert cameras == [(s, e) for s in ("bayer", "rgbw") for e in ("0.004", "0.016")]


def test_the_tutorials_files_are_those_of_the_example_plugin():
    acme = ROOT / "tests" / "example_plugin" / "acme_camera" / "conf"
    for path in re.findall(r"`acme_camera/conf/([\w/]+\.yaml)`", PLUGINS):
        assert (acme / path).exists(), path


def test_the_contracts_name_every_kind():
    assert all(re.search(rf"^\| {kind} \|", CONTRACTS, re.MULTILINE) for kind in KINDS)
    assert {kind for kind, _ in components()} == set(KINDS)


def test_every_kind_and_border_is_in_the_glossary():
    words = set(re.findall(r"^\| ([\w -]+?) \|", GLOSSARY, re.MULTILINE))
    assert words >= {
        *KINDS,
        "scene radiance",
        "mixed radiance",
        "irradiance",
        "captures",
        "picture",
        "truth",
        "score",
        "demand",
        "ledger",
    }


def test_no_word_is_explained_twice():
    words = [w for w in re.findall(r"^\| ([\w -]+?) \|", GLOSSARY, re.MULTILINE) if w != "word"]
    assert len(words) == len(set(words)), sorted(w for w in words if words.count(w) > 1)


def test_the_contracts_list_every_ability_with_its_parameters():
    kinds: dict[type, list[str]] = {protocol: ["any"] for protocol in by_kind.OF_ANY_KIND}
    for kind, offered in by_kind.OPTIONAL.items():
        for protocol in offered:
            kinds.setdefault(protocol, []).append(kind)
    for protocol, of in kinds.items():
        members = [
            f"{name}({', '.join(signature.parameters)})"
            for name, signature in abilities.methods(protocol).items()
            if name != abilities.CALL
        ]
        members += [
            *(n for n in vars(protocol) if n in abilities.fields(protocol)),
            *abilities.constants(protocol),
        ]
        written = ", ".join(f"`{member}`" for member in members)
        row = f"| {', '.join(of)} | `{protocol.__name__}` | {written} | "
        assert f"\n{row}" in CONTRACTS, f"docs/reference/contracts.md needs a row: {row}"


def test_no_ability_is_listed_that_does_not_exist():
    listed = set(re.findall(r"^\| [a-z, ]+ \| `([A-Z]\w+)` \|", CONTRACTS, re.MULTILINE))
    known = {p.__name__ for kind in KINDS for p in by_kind.abilities_of(kind)}
    assert listed == known
