"""Fixtures for all tests. Each test writes into a folder of its own."""

from __future__ import annotations

import gc
import itertools
import os
import sys
from functools import partial
from pathlib import Path

import pytest

# test files that take more than three CPU seconds, longest first. Each worker process takes one
# file at a time. The last files should be short, so that all workers end at about the same time
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
    "mitsuba/paths/by_need/test_rounds.py",
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
    """Stop garbage collection while five thousand tests are collected; they hold no garbage."""
    gc.disable()
    send_what_is_shown(session.config)


def send_what_is_shown(config):
    """Let each worker process send one message per test instead of five.

    The terminal does not show begins and ends of tests, nor setups and teardowns that passed. Their
    messages take 2 ms on both sides. With the option `--durations`, all messages are sent.
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
    """Return whether a hook sends the messages of a worker process of pytest-xdist."""
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
    """Exclude the collected tests from later garbage collections: saves 6 % of the tests' time."""
    gc.enable()
    gc.collect()
    gc.freeze()


def draw_examples_whatever_is_imported():
    """Let hypothesis draw the same examples in each order of the tests.

    By default, hypothesis also tries numbers that it finds in the source files of all modules
    imported so far. Reading these thousand files takes two CPU seconds in each process.
    """
    providers = sys.modules.get("hypothesis.internal.conjecture.providers")
    if providers is not None:
        providers._get_local_constants = lambda: providers._local_constants


def pytest_unconfigure():
    """Let the interpreter free all objects at exit; C++ bindings warn about objects that stay."""
    gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def power_stays_on():
    """Replace `os.fsync` by nothing: its wait for the disk takes 2 ms for each file of a store.

    Only a power cut makes a difference. tests/core/storage/test_store.py checks that stores call
    `os.fsync`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(scope="session")
def unmade_folders(tmp_path_factory):
    """Return an iterator over paths of folders that do not exist yet, one for each test."""
    parent = tmp_path_factory.getbasetemp() / "homes"
    return (parent / str(number) for number in itertools.count())


@pytest.fixture(autouse=True)
def isethdr_home(request, unmade_folders, monkeypatch):
    """Let every store that a test writes go to the test's own home folder, and return its path.

    The first store creates the folder. To create one for each test that writes no store would take
    a millisecond, and to remove it another millisecond.
    """
    own = "tmp_path" in request.fixturenames
    home = (request.getfixturevalue("tmp_path") if own else next(unmade_folders)) / "isethdr_home"
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    monkeypatch.setenv("ISETHDR_CACHE", str(home / "cache"))
    monkeypatch.delenv("ISETHDR_PLUGINS", raising=False)
    return home


@pytest.fixture(scope="session", autouse=True)
def no_page():
    """Leave out the report of a run: its plots take a second. Tests of the catalog do write it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("isethdr_catalog.report.write_report", lambda result: None)
        yield


@pytest.fixture
def offer(monkeypatch):
    """Return a function that registers a class as a component for the duration of one test."""
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
