"""Provenance: an edit changes the name of a result if and only if it can change the result."""

from isethdr_core import build
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
