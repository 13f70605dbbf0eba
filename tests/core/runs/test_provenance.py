"""Provenance: an edit that can change a result changes its name, and no other."""

import sys

import pytest

from isethdr_core.runs.provenance import fingerprint, input_digests, source_digest, versions


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "isethdr_made_up"
    (folder / "conf").mkdir(parents=True)
    (folder / "__init__.py").write_text("A = 1\n")
    (folder / "conf" / "night.yaml").write_text("a: 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    sys.modules.pop("isethdr_made_up", None)


def digest():
    source_digest.cache_clear()
    return source_digest("isethdr_made_up")


def test_source_changes_the_digest_and_a_preset_does_not(package):
    first = digest()
    (package / "conf" / "night.yaml").write_text("a: 2\n")
    assert digest() == first
    (package / "table.csv").write_text("1,2\n")
    second = digest()
    assert second != first
    (package / "__init__.py").write_text("A = 2\n")
    assert digest() != second


def test_a_module_of_one_file_has_a_digest_of_its_own(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "isethdr_one_file.py").write_text("A = 1\n")
    source_digest.cache_clear()
    first = source_digest("isethdr_one_file")
    (tmp_path / "isethdr_one_file.py").write_text("A = 2\n")
    source_digest.cache_clear()
    assert source_digest("isethdr_one_file") != first


def test_a_part_of_the_core_does_not_answer_for_the_rest():
    assert set(fingerprint(core=("isethdr_core.scene",))) == {"isethdr_core.scene"}
    assert (
        fingerprint(core=("isethdr_core.scene",))["isethdr_core.scene"]
        != fingerprint()["isethdr_core"]
    )
    assert "numpy" in versions()


def test_input_files_are_named_by_their_content(tmp_path):
    class Reader:
        def input_files(self):
            return (tmp_path / "curve.csv",)

    (tmp_path / "curve.csv").write_text("1")
    first = input_digests(Reader(), object())
    (tmp_path / "curve.csv").write_text("2")
    assert list(first) == list(input_digests(Reader())) and first != input_digests(Reader())
