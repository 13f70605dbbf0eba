"""Large libraries are loaded when they are first used: a config is composed without them."""

from __future__ import annotations

import importlib
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from isethdr_core.cli import deferred_libraries

from ..command_line import isethdr

LIBRARY = """
import time, deferred_example
early = hasattr(deferred_example, "number")  # of itself, while it is loaded
time.sleep(0.05)  # other threads ask for names in the meantime
from deferred_example_parts import number
loaded = loaded + 1 if "loaded" in globals() else 1
"""


@pytest.mark.slow
def test_a_config_is_composed_without_xarray_pandas_the_chain_and_tables():
    """Reporting a mistake in a config needs none of them either.

    Each of them takes as long to load as Hydra itself.
    """
    shown = isethdr("run", "--cfg", "job", PYTHONPROFILEIMPORTTIME="1")
    assert shown.returncode == 0 and "noise_fraction_allowed: 0.1" in shown.stdout
    loaded = {line.rpartition("|")[2].strip() for line in shown.stderr.splitlines()}
    assert "isethdr_isp.develop" in loaded, "components were imported for their fields"
    assert not {"pandas", "xarray.core", "isethdr_core.pipeline.chain", "rich.table"} & loaded


def test_a_deferred_library_is_loaded_once_by_the_first_name(tmp_path, monkeypatch):
    (tmp_path / "deferred_example.py").write_text(LIBRARY)
    (tmp_path / "deferred_example_parts.py").write_text("number = 7\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(deferred_libraries, "LIBRARIES", ("deferred_example",))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    deferred_libraries.defer()
    deferred_libraries.defer()
    first = importlib.import_module("deferred_example")
    again = importlib.import_module("deferred_example")
    assert first is again and "number" not in vars(first)
    assert "deferred_example_parts" not in sys.modules
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: (first.number, first.loaded, first.early), range(8)))
    assert found == [(7, 1, False)] * 8
    assert importlib.reload(first).loaded == 2, "afterwards it is a module like any other"


def test_a_deferred_library_that_fails_says_so_each_time(tmp_path, monkeypatch):
    (tmp_path / "deferred_broken.py").write_text("raise ValueError('broken')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(deferred_libraries, "LIBRARIES", ("deferred_broken",))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    deferred_libraries.defer()
    broken = importlib.import_module("deferred_broken")
    for _ in range(2):
        with pytest.raises(ValueError, match="broken"):
            _ = broken.number


@pytest.mark.slow
def test_known_components_are_listed_without_numpy():
    """Descriptions are cached, so that `isethdr plugins` answers as quickly as tab completion."""
    isethdr("plugins", "lens")  # writes descriptions that are not in the cache yet
    shown = isethdr("plugins", "lens", PYTHONPROFILEIMPORTTIME="1")
    loaded = {line.rpartition("|")[2].strip() for line in shown.stderr.splitlines()}
    assert "wavefront" in shown.stdout and "rich.text" in loaded and "numpy" not in loaded
