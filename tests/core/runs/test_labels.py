"""Names and tags of runs are checked when typed, kept in a file next to the store, and part of no
hash.
"""

from __future__ import annotations

import pytest

from isethdr_core.config.composition import compose
from isethdr_core.config.typed_text import with_texts
from isethdr_core.errors import ConfigError
from isethdr_core.runs.labels import SUFFIX, Labels, add_labels, checked, labels_of, read_labels
from isethdr_core.runs.run import plain


@pytest.mark.parametrize("text", ["a/b", "..", "a b", "x" * 101, "a:b", "\n", "a,b"])
def test_a_name_or_tag_that_cannot_be_one_says_what_to_type(text):
    with pytest.raises(ConfigError, match=r"the tag is .*; type for example tags=\[\w+\]"):
        labels_of({"tags": [text]})
    with pytest.raises(ConfigError, match=r"the name is .*; type for example name=\w+"):
        labels_of({"name": text})


def test_labels_of_a_config():
    assert labels_of(compose(["name=first", "tags=[night,1.5]"])) == Labels(
        "first", ("night", "1.5")
    )
    assert labels_of({"tags": "night"}) == Labels(tags=("night",)) and labels_of({}) == Labels()


def test_labels_change_no_hash():
    assert plain(compose(["name=first", "tags=[night]"])) == plain(compose())


def test_labels_of_a_store_grow(tmp_path):
    store = tmp_path / "1f3a.zarr"
    assert read_labels(store) == Labels()
    add_labels(store, Labels("first", ("night",)))
    add_labels(store, Labels(tags=("wet", "night"), sweeps=("s",)))
    assert read_labels(store) == Labels("first", ("night", "wet"), ("s",))
    before = (tmp_path / f"1f3a{SUFFIX}").stat()
    add_labels(store, Labels(tags=("wet",)))
    assert (tmp_path / f"1f3a{SUFFIX}").stat().st_mtime_ns == before.st_mtime_ns
    for damaged in ("{", "[]", "{}"):
        (tmp_path / f"1f3a{SUFFIX}").write_text(damaged)
        assert read_labels(store) == Labels()


def test_tags_may_be_typed_with_commas():
    assert with_texts(["tags=a,b", "tags=[c]", "sensor=a,b"]) == [
        "tags=[a,b]",
        "tags=[c]",
        "sensor=a,b",
    ]


def test_a_name_fits_the_name_of_a_folder_in_every_script():
    assert checked("name", 85 * "\u540d") == 85 * "\u540d"  # three bytes each
    with pytest.raises(ConfigError, match=r"at most 255 bytes in all; .*name=\w{33}$"):
        checked("name", 86 * "\u540d")


def test_labels_that_are_no_text_count_as_none(tmp_path):
    (tmp_path / f"1f3a{SUFFIX}").write_bytes(b'{"name": "\xff"}')
    assert read_labels(tmp_path / "1f3a.zarr") == Labels()
