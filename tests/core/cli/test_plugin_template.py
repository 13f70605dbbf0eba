"""Copier writes the same packages as new-plugin from the plugin template, and updates older ones.

Copier is in the extra `test-copier`; `make test-extras` runs this file.
"""

from __future__ import annotations

import keyword
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from isethdr_core.cli.new_plugin import ANSWERS_FILE, TEMPLATE, NewPlugin, make_plugin
from isethdr_core.plugins.component import KINDS

ROOT = Path(__file__).parents[3]
SOURCE = ("_commit", "_src_path")  # answers that only copier writes: the template's origin
ANSWERS = {"kind": "metric", "name": "acme_quantile"}


@pytest.fixture
def copier(monkeypatch):
    """Return the library copier, and set the author's name that git needs for commits."""
    for role in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{role}_NAME", "A Tester")
        monkeypatch.setenv(f"GIT_{role}_EMAIL", "tester@example.org")
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    return pytest.importorskip("copier")


def git(folder: Path, *words: str) -> None:
    """Run git in a folder."""
    subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True)


def commit(folder: Path) -> None:
    """Commit everything in a folder, which becomes a repository if it is none."""
    if not (folder / ".git").exists():
        git(folder, "init", "--quiet")
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "all")


@pytest.fixture
def repository(tmp_path) -> Path:
    """Return a repository with isethdr's template, at version 1."""
    folder = tmp_path / "isethdr"
    shutil.copytree(TEMPLATE, folder / TEMPLATE.relative_to(ROOT))
    shutil.copy(ROOT / "copier.yml", folder)
    commit(folder)
    git(folder, "tag", "v1.0.0")
    return folder


def release(repository: Path) -> None:
    """Change the template in two files, and tag it as version 2."""
    package = repository / TEMPLATE.relative_to(ROOT) / "package"
    for name, old, new in (
        (".gitignore.jinja", "dist/\n", "dist/\nbuild/\n"),
        ("pyproject.toml.jinja", 'test = ["pytest>=8"]', 'test = ["pytest>=9"]'),
    ):
        text = (package / name).read_text()
        assert text.count(old) == 1
        (package / name).write_text(text.replace(old, new))
    commit(repository)
    git(repository, "tag", "v2.0.0")


def tree(folder: Path) -> Iterator[tuple[str, object]]:
    """Yield (path, content) of every file; of the answers file, the lines new-plugin writes too."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_dir() or name.startswith(".git/"):
            continue
        text = path.read_text(encoding="utf-8")
        if name == ANSWERS_FILE:
            kept = [line for line in text.splitlines() if not line.startswith(SOURCE)]
            yield name, kept
        else:
            yield name, text


def answers(package: Path) -> dict[str, str]:
    return yaml.safe_load((package / ANSWERS_FILE).read_text())


def test_the_questions_offer_the_kinds_of_isethdr():
    questions = yaml.safe_load((TEMPLATE / "copier.yml").read_text())
    assert questions["kind"]["choices"] == list(KINDS)


def test_the_keywords_of_python_are_no_names():
    rule = yaml.safe_load((TEMPLATE / "copier.yml").read_text())["name"]["validator"]
    lower_case = {word for word in keyword.kwlist if word.islower()}
    assert set(re.findall(r'"([a-z]+)"', rule)) == lower_case
    assert "cannot be that of a Python package" in NewPlugin("metric", "yield").name_mistake()
    for name in ("a", "a1_b2", "yields"):
        assert not NewPlugin("metric", name).name_mistake()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_copier_writes_the_package_of_new_plugin(copier, repository, tmp_path, kind):
    name = f"acme_{kind}"
    made = make_plugin(kind, name, tmp_path)
    data = {"kind": kind, "name": name}
    # from the repository, and from the folder that is installed with isethdr
    for number, source in enumerate((repository, TEMPLATE)):
        copied = tmp_path / f"copied_{number}"
        copier.run_copy(str(source), copied, data=data, defaults=True, quiet=True)
        assert dict(tree(copied)) == dict(tree(made))
        assert answers(copied)["_src_path"] == str(source)
    assert answers(made) == data


@pytest.mark.slow
def test_copier_refuses_the_names_that_new_plugin_refuses(copier, tmp_path):
    for name in ("2mono", "acme-mono", "AcmeMono", "_mono", "mono_", "a__b", "lambda", "größe", ""):
        assert NewPlugin("sensor", name).name_mistake()
        data = {"kind": "sensor", "name": name}
        with pytest.raises(ValueError, match="cannot be that of a Python package"):
            copier.run_copy(str(TEMPLATE), tmp_path / "new", data=data, defaults=True, quiet=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_an_update_brings_changes_of_the_template_and_keeps_those_of_the_author(
    copier, repository, tmp_path
):
    package = tmp_path / "package"
    copier.run_copy(str(repository), package, data=ANSWERS, defaults=True, quiet=True)
    _check_update(copier, repository, package)


@pytest.mark.slow
def test_a_package_of_new_plugin_can_be_updated_once_it_knows_its_template(
    copier, repository, tmp_path
):
    """The command of docs/how-to/plugins.md names the template, and leaves the author's files."""
    package = make_plugin(ANSWERS["kind"], ANSWERS["name"], tmp_path)
    (package / "README.md").write_text("the author's\n")
    before = dict(tree(package))
    command = "copier copy --defaults --overwrite -x '*' -x '!.copier-answers.yml' ISETHDR ."
    assert f"    {command}\n" in (ROOT / "docs" / "how-to" / "plugins.md").read_text()
    words = shlex.split(command.replace("ISETHDR", str(repository)))
    done = subprocess.run([sys.executable, "-m", *words], cwd=package, check=False)
    assert done.returncode == 0 and dict(tree(package)) == before
    _check_update(copier, repository, package)


def _check_update(copier, repository: Path, package: Path) -> None:
    assert answers(package) == {**ANSWERS, "_commit": "v1.0.0", "_src_path": str(repository)}
    module = package / "acme_quantile" / "metric.py"
    module.write_text(module.read_text() + "\n# the author's\n")
    project = package / "pyproject.toml"
    project.write_text(project.read_text().replace('version = "0.1.0"', 'version = "7.0"'))
    commit(package)
    before = dict(tree(package))
    release(repository)
    copier.run_update(package, defaults=True, overwrite=True, quiet=True)
    after = dict(tree(package))
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == {".gitignore", "pyproject.toml"} and after.keys() == before.keys()
    assert after[".gitignore"] == before[".gitignore"].replace("dist/\n", "dist/\nbuild/\n")
    # one file holds the author's change and that of the template
    assert after["pyproject.toml"] == before["pyproject.toml"].replace("pytest>=8", "pytest>=9")
    assert answers(package)["_commit"] == "v2.0.0"
