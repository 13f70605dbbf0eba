"""A damaged store is named, file by file; it never returns other values than were written."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import xarray as xr
import zarr
from isethdr_catalog.verify import verify_store
from zarr.abc.store import OffsetByteRequest, RangeByteRequest, SuffixByteRequest

from isethdr_core.errors import CatalogError
from isethdr_core.storage import store
from isethdr_core.storage.manifest import read_manifest
from isethdr_core.storage.reader import ManifestStore

from .. import store_damage as d


@pytest.fixture(scope="module")
def stores(tmp_path_factory):
    """Return a store, its content, and an older store of the same form."""
    folder = tmp_path_factory.mktemp("stores")
    path = d.write(folder / "now", seed=0)
    return path, d.read(path), d.write(folder / "before", seed=1)


def test_the_damages_are_many_and_of_every_kind(stores):
    path, _, older = stores
    found = [damage.what.split()[0] for damage in d.damages(path, older)]
    assert len(found) >= 200
    assert {
        "delete",
        "cut",
        "extend",
        "bit",
        "older",
        "exchange",
        *(e.__name__ for e in d.EDITS),
    } == set(found)


def test_no_damage_is_silent_and_each_error_names_store_and_file(stores, tmp_path):
    """Try every 20th damage, which is quick; the slow test below tries all."""
    assert _not_named(stores, tmp_path, step=20) == []


@pytest.mark.slow
def test_no_damage_at_all_is_silent(stores, tmp_path):
    assert _not_named(stores, tmp_path, step=1) == []


def _not_named(stores, tmp_path, step: int) -> list[tuple[str, str]]:
    path, original, older = stores
    wrong = []
    for number, damage in enumerate(list(d.damages(path, older))[::step]):
        copy = tmp_path / str(number) / path.name
        shutil.copytree(path, copy)
        damage.apply(copy)
        said = d.outcome(copy, original)
        if str(copy) not in said or not any(name in said for name in damage.names):
            wrong.append((damage.what, said))
        if not verify_store(copy).problems:
            wrong.append((damage.what, "verify finds nothing"))
        shutil.rmtree(copy.parent)
    return wrong


def test_files_that_do_not_belong_are_never_read_and_are_named_by_verify(stores, tmp_path):
    path, original, _ = stores
    copy = tmp_path / path.name
    shutil.copytree(path, copy)
    shutil.copytree(copy / "picture", copy / "picture" / "more")
    (copy / "radiance" / "c.0.0.0.9").write_bytes(b"more")
    assert d.outcome(copy, original) == "same"
    with pytest.raises(CatalogError, match="cannot open group 'picture/more'"):
        store.open_store(copy, "picture/more")
    assert any("radiance/c.0.0.0.9 is not part" in line for line in verify_store(copy).problems)


def test_a_store_under_the_name_of_another_is_refused(stores, tmp_path):
    path, original, _ = stores
    for name in ("s", "other"):
        shutil.copytree(path, tmp_path / f"{name}.zarr")
    assert d.outcome(tmp_path / "s.zarr", original) == "same"
    with pytest.raises(CatalogError, match=r"holds the data of 's'.*rename it to s\.zarr"):
        store.read_attrs(tmp_path / "other.zarr")
    (tmp_path / "link.zarr").symlink_to(tmp_path / "s.zarr")
    assert d.outcome(tmp_path / "link.zarr", original) == "same"


def test_damage_after_opening_is_named_when_the_part_is_read(stores, tmp_path):
    """A lazy read checks only the chunks that it needs, so that reading one tile stays cheap."""
    path, original, older = stores
    copy = tmp_path / path.name
    shutil.copytree(path, copy)
    opened = store.open_store(copy)
    file = "radiance/c.1.0.0.0"
    shutil.copy(older / file, copy / file)
    first = opened.radiance[0, 1, :3].values
    assert np.array_equal(first, original[""].radiance[0, 1, :3].values)
    with pytest.raises(CatalogError, match=f"{copy}.*{file}"):
        opened.radiance[1, 1, :3].load()
    (copy / file).unlink()
    with pytest.raises(CatalogError, match=f"{copy}.*{file} is missing"):
        opened.radiance[1, 1, 3:5].load()


def test_chunks_of_one_shard_cannot_change_places(tmp_path):
    """Two chunks of equal length change places in a shard; each still fits its own CRC-32C."""
    planes = np.random.default_rng(1).integers(0, 256, (540, 1920), "u1")  # not compressible
    path = store.write_store(tmp_path, "s", {"": xr.Dataset({"a": (("y", "x"), planes)})}, {})
    file = path / "a/c.0.0"
    data = file.read_bytes()
    first = read_manifest(path).files["a/c.0.0"].parts[0].size
    file.write_bytes(data[first : 2 * first] + data[:first] + data[2 * first :])
    assert not np.array_equal(zarr.open_array(path / "a", mode="r")[...], planes), (
        "no other reader notices"
    )
    with pytest.raises(CatalogError, match="a/c.0.0 holds other chunks"):
        store.open_store(path).load()


def test_other_readers_of_zarr_see_a_plain_store(stores, recwarn):
    path, original, _ = stores
    plain = xr.open_zarr(path, group="picture/bayer", consolidated=False, chunks=None)
    assert np.array_equal(plain.xyz.values, original["picture/bayer"].xyz.values)
    assert sorted(name for name, _ in zarr.open_group(path, mode="r").groups()) == [
        "captures",
        "picture",
        "truth",
    ]
    assert not recwarn.list


@pytest.mark.parametrize("key", ["manifest", "manifest/a"])
def test_the_name_of_the_manifest_is_kept_free(tmp_path, key):
    with pytest.raises(CatalogError, match="is the store's own"):
        store.write_store(tmp_path, "s", {key: xr.Dataset()}, {})


def test_any_range_of_a_file_is_compared(stores, tmp_path):
    """For a range that is not a chunk, as other versions of zarr may request, the whole file is
    checked.
    """
    path, _, older = stores
    copy = tmp_path / path.name
    shutil.copytree(path, copy)
    reader = ManifestStore(copy, read_manifest(copy))
    file = "picture/bayer/xyz/c.0.0.0"
    data = (copy / file).read_bytes()
    for wanted, expected in (
        (RangeByteRequest(3, 9), data[3:9]),
        (OffsetByteRequest(5), data[5:]),
        (SuffixByteRequest(7), data[-7:]),
    ):
        assert reader.get_sync(file, byte_range=wanted).to_bytes() == expected
    shutil.copy(older / file, copy / file)
    with pytest.raises(CatalogError, match=f"{file} (has|holds)"):
        reader.get_sync(file, byte_range=RangeByteRequest(3, 9))
    assert reader.get_sync("picture/bayer/xyz/c.0.0.1") is None
