"""One home folder for all tests of exports, which only read it."""

from __future__ import annotations

import pytest

from .stored_runs import stored_home


@pytest.fixture(scope="session")
def made_home(tmp_path_factory):
    """Make the runs once."""
    folder = tmp_path_factory.mktemp("exports")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISETHDR_HOME", str(folder))
        return stored_home(folder)


@pytest.fixture
def home(made_home, isethdr_home, monkeypatch):
    """Return the home folder with the runs, in place of the test's own."""
    monkeypatch.setenv("ISETHDR_HOME", str(made_home.folder))
    return made_home
