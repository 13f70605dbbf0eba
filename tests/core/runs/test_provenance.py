"""Provenance: an edit changes the name of a result if and only if it can change the result."""

import os
from pathlib import Path

import pytest

from isethdr_core import build
from isethdr_core.errors import PluginError
from isethdr_core.identity.code_digest import frame_code
from isethdr_core.runs import provenance
from isethdr_core.runs.provenance import (
    fingerprint,
    have_source,
    identity,
    input_digests,
    libraries,
)


def test_a_component_is_named_by_kind_and_registered_name(offer):
    lens = build("lens", "wavefront")
    assert identity(lens) == "lens/wavefront"
    moved = type("Wavefront", (type(lens),), {"__module__": "elsewhere.lenses"})
    assert identity(moved()) == "Wavefront"  # not registered yet
    offer("lens", "wavefront", moved)
    assert identity(moved()) == "lens/wavefront"


def test_a_class_registered_twice_has_one_name():
    assert identity(build("scene", "uniform")) == identity(build("scene", "ideal")) == "scene/ideal"


def test_the_fingerprint_names_each_component_and_the_frame():
    lens = build("lens", "ideal")
    flare = build("flare", "haze")
    found = fingerprint(lens, None, flare, frame=True)
    assert list(found) == ["core", "flare/haze", "lens/ideal"]
    assert found["core"] == frame_code().digest
    assert fingerprint(flare) == {"flare/haze": found["flare/haze"]}


def test_versions_are_those_of_libraries_that_the_components_import():
    scene = build("scene", "uniform")
    renderer = build("renderer", "mitsuba")
    assert "mitsuba" in libraries(renderer) and "mitsuba" not in libraries(scene)
    assert "colour-science" in libraries(scene) and "hydra-core" not in libraries(scene)
    assert libraries(scene).items() <= libraries(scene, renderer).items()
    assert {"isethdr", "numpy"} <= provenance.versions().keys()  # recorded for users


def test_a_class_typed_at_a_prompt_has_no_source():
    scope: dict = {"__name__": "prompt"}
    exec("class Lens: pass", scope)  # noqa: S102 - as typed at a prompt
    assert not have_source(scope["Lens"]()) and have_source(build("lens", "ideal"))


def test_input_files_are_named_by_their_content(tmp_path):
    class Reader:
        def input_files(self):
            return (tmp_path / "curve.csv",)

    (tmp_path / "curve.csv").write_text("1")
    first = input_digests(Reader(), object())
    (tmp_path / "curve.csv").write_text("2")
    assert list(first) == list(input_digests(Reader())) and first != input_digests(Reader())


@pytest.mark.parametrize("kind", [str, Path, os.fsencode])
def test_one_path_instead_of_several_is_refused(tmp_path, kind):
    (tmp_path / "curve.csv").write_text("1")

    class Reader:
        def input_files(self):
            return kind(str(tmp_path / "curve.csv"))

    with pytest.raises(PluginError, match=r"Reader: .*curve.csv.*type `return \(path,\)`"):
        input_digests(Reader())


def test_an_input_folder_stands_for_all_files_below_it(tmp_path):
    class Reader:
        def input_files(self):
            return (str(tmp_path / "curves"), tmp_path / "missing")

    inner = tmp_path / "curves" / "red"
    inner.mkdir(parents=True)
    (inner / "a.csv").write_text("1")
    first = input_digests(Reader())
    assert list(first) == [str(inner / "a.csv")]
    (inner / "a.csv").write_text("2")
    second = input_digests(Reader())
    assert second.keys() == first.keys() and second != first
    (tmp_path / "curves" / "b.csv").write_text("1")
    assert len(input_digests(Reader())) == 2


def test_an_input_folder_stands_for_files_in_linked_folders(tmp_path):
    class Reader:
        def input_files(self):
            return (os.fsencode(tmp_path / "curves"),)

    (tmp_path / "curves").mkdir()
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "a.csv").write_text("1")
    for name in ("left", "right"):
        (tmp_path / "curves" / name).symlink_to(tmp_path / "real")
    (tmp_path / "real" / "back").symlink_to(tmp_path / "curves")  # a cycle
    first = input_digests(Reader())
    assert list(first) == [str(tmp_path / "curves" / name / "a.csv") for name in ("left", "right")]
    (tmp_path / "real" / "a.csv").write_text("2")
    assert not first.items() & input_digests(Reader()).items()
