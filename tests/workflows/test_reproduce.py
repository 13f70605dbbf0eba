"""`isethdr reproduce`, as users type it: with a plugin that has changed, and a rendered scene."""

from __future__ import annotations

import pytest

from .command import LIGHTS, WITHOUT_REPORT, installed_trouble, isethdr
from .test_rendered import TINY

WITH_CATALOG = {"ISETHDR_PLUGINS": f"{WITHOUT_REPORT},catalog"}


def key_of(home) -> str:
    """Return the key of the only run of a home."""
    [path] = (home / "runs").glob("*.zarr")
    return path.stem


@pytest.mark.slow
def test_a_changed_constant_of_a_plugin_is_named_with_its_number(isethdr_home, tmp_path):
    plugins = [installed_trouble(tmp_path / "plugins")]
    made = isethdr(
        "run",
        *LIGHTS,
        "lighting=ideal",
        "sensor=ideal",
        "report=false",
        "+metric@metric.acme=acme",
        plugins=plugins,
        **WITH_CATALOG,
    )
    assert made.returncode == 0, made.stderr
    key = key_of(isethdr_home)
    module = plugins[0] / "acme_trouble.py"
    text = module.read_text()
    assert text.count('Score("acme", 1.0,') == 1
    module.write_text(text.replace('Score("acme", 1.0,', 'Score("acme", 2.0,'))
    again = isethdr("reproduce", key, plugins=plugins, **WITH_CATALOG)
    assert again.returncode == 1, again.stderr
    assert "metric/acme: " in again.stdout, "the code that differs is named"
    assert "ideal acme" in again.stdout and "1 of " in again.stdout, again.stdout
    assert "numbers differ, 1 of them beyond their intervals or without one" in again.stdout


@pytest.mark.slow
def test_a_rendered_scene_is_rendered_again_with_the_same_numbers(isethdr_home):
    made = isethdr("run", *TINY, "+lighting.weights.sky=1", "report=false", **WITH_CATALOG)
    assert made.returncode == 0, made.stderr
    again = isethdr("reproduce", key_of(isethdr_home), **WITH_CATALOG)
    assert again.returncode == 0, again.stdout + again.stderr
    assert "the same versions" in again.stdout and "\n0 of " in again.stdout
