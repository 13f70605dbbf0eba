"""Fixtures for all tests. Each test writes into a folder of its own."""

from __future__ import annotations

import gc
import itertools
import os
import sys
from functools import partial
from pathlib import Path

import pytest

# files of more than three CPU seconds, the longest first: the processes that share the tests take
# file by file, and what comes last should be short, so that they end together
LONGEST_FIRST = (
    "core/test_conformance.py",
    "core/test_conformance_kit.py",
    "core/config/test_composition.py",
    "catalog/test_report.py",
    "workflows/dataset/test_generate.py",
    "workflows/test_failures.py",
    "mitsuba/paths/test_integrator.py",
    "optics/plan/test_light_path.py",
    "scenes/test_night_drive.py",
    "workflows/test_recipes.py",
    "optics/plan/test_window.py",
    "mitsuba/test_need_driven.py",
    "scenes/test_vehicles.py",
    "catalog/test_index.py",
    "optics/imaging/test_sensor_plane.py",
    "optics/psf/test_scaled_pattern.py",
    "core/storage/test_store.py",
    "core/runs/test_reuse.py",
    "core/identity/test_earlier_names.py",
    "core/plugins/test_frozen_plugins.py",
    "workflows/test_sweeps.py",
    "optics/test_traced_colour.py",
    "workflows/test_stability.py",
    "optics/flare/test_aperture.py",
    "core/test_example_plugin.py",
    "core/pipeline/test_chain.py",
    "scenes/test_sky.py",
    "scenes/test_models.py",
    "core/cli/test_deferred_libraries.py",
    "core/identity/test_code_digest.py",
    "core/uncertainty/test_score_errors.py",
    "workflows/test_accuracy_study.py",
    "optics/test_exit_pupil.py",
    "optics/imaging/test_photocurrent.py",
    "mitsuba/test_wide_angles.py",
    "core/uncertainty/test_propagation.py",
    "core/cli/test_completion.py",
    "catalog/test_space.py",
    "core/pipeline/test_window.py",
    "core/test_lighting_targets.py",
    "optics/test_vignetting.py",
    "properties/test_laws.py",
    "scenes/test_living.py",
    "core/plugins/test_registry.py",
    "scenes/test_sumo_traffic.py",
    "scenes/test_traffic.py",
    "scenes/test_placing.py",
    "workflows/dataset/test_pairs.py",
    "catalog/test_stored_scores.py",
    "mitsuba/test_scalar.py",
    "optics/test_focal_shift.py",
    "catalog/test_catalog.py",
    "core/cli/test_commands.py",
    "isp/readout/test_interleaved.py",
    "scenes/test_street.py",
)


@pytest.fixture
def largest_difference(record_property):
    """Return a function that compares an array with the expected one.

    The function takes (name of the quantity, found array, expected array). It returns the largest
    difference over the largest expected value. The XML report of the tests lists this number under
    the name; `scripts/agreement_isetcam.py` reads it there.
    """

    def of(quantity, found, expected):
        difference = float(abs(found - expected).max() / abs(expected).max())
        record_property(quantity, difference)
        return difference

    return of


def pytest_collection(session):
    """Count no objects while five thousand tests are collected, of which none is garbage."""
    gc.disable()
    send_what_is_shown(session.config)


def send_what_is_shown(config):
    """Let a process that shares the tests send one message a test instead of five: setups and
    teardowns that passed, begins and ends are not shown. These messages take 2 ms of both sides.
    """
    if config.getoption("durations") is not None:
        return
    hooks = config.hook
    for begins_or_ends in (hooks.pytest_runtest_logstart, hooks.pytest_runtest_logfinish):
        for one in filter(of_a_process, begins_or_ends.get_hookimpls()):
            one.function = lambda nodeid, location: None
    for one in filter(of_a_process, hooks.pytest_runtest_logreport.get_hookimpls()):
        one.function = partial(send_report, one.function)


def of_a_process(hook) -> bool:
    """Return whether a hook sends messages from a process that shares the tests."""
    return type(hook.plugin).__name__ == "WorkerInteractor"


def send_report(send, report):
    """Send the report of a test, or of a setup or teardown that did not pass."""
    if report.when == "call" or not report.passed:
        send(report)


def pytest_collection_modifyitems(items):
    """Put the tests of the longest files first; the order within a file stays."""
    draw_examples_whatever_is_imported()
    here = Path(__file__).parent
    place = {here / name: k for k, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: place.get(item.path, len(place)))


def pytest_collection_finish():
    """Leave what was collected out of all later searches for garbage: 6 % of the tests' time."""
    gc.enable()
    gc.collect()
    gc.freeze()


def draw_examples_whatever_is_imported():
    """Let hypothesis draw the same examples in each order of the tests.

    It would try numbers that it finds in the source files of all modules imported so far, and reads
    a thousand files for this: two CPU seconds in each process.
    """
    providers = sys.modules.get("hypothesis.internal.conjecture.providers")
    if providers is not None:
        providers._get_local_constants = lambda: providers._local_constants


def pytest_unconfigure():
    """Let the interpreter free all objects at its end; bindings complain about those it keeps."""
    gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def power_stays_on():
    """Leave out the wait for the disk at the end of each store: 2 ms for each of its files.

    Only a power cut could tell; tests/core/storage/test_store.py checks that stores ask for it.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(scope="session")
def unmade_folders(tmp_path_factory):
    """Return names of folders that are new and not made yet, one for each test that asks."""
    parent = tmp_path_factory.getbasetemp() / "homes"
    return (parent / str(number) for number in itertools.count())


@pytest.fixture(autouse=True)
def isethdr_home(request, unmade_folders, monkeypatch):
    """Send every store that a test makes to the test's own folder, and return it.

    It is made by the first store. A folder for each of the tests that make none would take a
    millisecond, and another one to remove it.
    """
    own = "tmp_path" in request.fixturenames
    home = (request.getfixturevalue("tmp_path") if own else next(unmade_folders)) / "isethdr_home"
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    monkeypatch.setenv("ISETHDR_CACHE", str(home / "cache"))
    monkeypatch.delenv("ISETHDR_PLUGINS", raising=False)
    return home


@pytest.fixture(scope="session", autouse=True)
def no_page():
    """Leave out the report of a run, whose plots take a second; tests of the catalog have them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("isethdr_catalog.report.write_report", lambda result: None)
        yield


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
