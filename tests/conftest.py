"""Fixtures for all tests: nothing is ever written outside the test's own folder."""

from __future__ import annotations

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def power_stays_on():
    """Leave out the wait for the disk at the end of each store: 2 ms for each of its files.

    Only a power cut could tell; tests/core/storage/test_store.py checks that stores ask for it.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(autouse=True)
def isethdr_home(tmp_path, monkeypatch):
    """Send every store that a test makes to the test's own folder, and return it."""
    home = tmp_path / "isethdr_home"
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    monkeypatch.setenv("ISETHDR_CACHE", str(home / "cache"))
    monkeypatch.delenv("ISETHDR_PLUGINS", raising=False)
    return home


@pytest.fixture(autouse=True)
def no_page(monkeypatch):
    """Leave out the report of a run, whose plots take a second; tests of the catalog have them."""
    monkeypatch.setattr("isethdr_catalog.report.write_report", lambda result: None)


@pytest.fixture
def offer(monkeypatch):
    """Return a function that offers a class as a component for the length of one test."""
    from isethdr_core.component import Component
    from isethdr_core.plugins import registry

    known = dict(registry.components())

    def add(kind: str, name: str, cls: type):
        comp = Component(kind, name, cls)
        registry._check(comp)
        known[kind, name] = comp
        return cls

    monkeypatch.setattr(registry, "components", lambda: known)
    return add
