"""A store is complete or absent, whatever happens to its writer, and holds the written data to a
stated error.
"""

import errno
import json
import os
import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest
import xarray as xr
import zarr

from isethdr_core.data import quantities as q
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage import store
from isethdr_core.storage.encoding import KEEPBITS, jsonable, keep_mantissa_bits, restored, tiling
from isethdr_core.storage.join import join_scenes


def scene(groups=("sky", "street"), bands=9, rows=140, columns=250, seed=0, **labels):
    light = np.random.default_rng(seed).lognormal(0, 8, (len(groups), bands, rows, columns))
    return q.scene_radiance(
        light,
        groups,
        np.linspace(400, 700, bands),
        q.centres(columns, 0.8),
        q.centres(rows, 0.5),
        **labels,
    )


def test_rounding_is_within_half_a_bit_and_unbiased():
    values = np.random.default_rng(1).lognormal(0, 12, 200_000).astype(np.float32)
    error = keep_mantissa_bits(values, 10).astype(float) / values - 1
    # half of the last kept bit, the best any rounding can do
    assert np.abs(error).max() <= 2.0**-11
    assert np.abs(error).max() > 0.95 * 2.0**-11  # no more than 10 bits are kept
    # rms error of uniform rounding is at most 2^-11/sqrt(3); the mean of 2e5 is then within 5 sigma
    # of 0
    assert abs(error.mean()) < 5 * 2.0**-11 / np.sqrt(3 * len(values))
    assert np.array_equal(keep_mantissa_bits(values, 23), values)


def test_rounding_breaks_ties_to_even_and_keeps_what_is_not_finite():
    tie = np.float32([1 + 2.0**-11, 1 + 3 * 2.0**-11])
    assert keep_mantissa_bits(tie, 10).tolist() == [1.0, 1 + 2.0**-9]
    odd = np.float32([0, -0.0, np.inf, -np.inf, np.nan, np.finfo(np.float32).max])
    assert np.array_equal(keep_mantissa_bits(odd, 10), odd, equal_nan=True)
    # NaNs with the smallest or the largest payload, which rounding would turn into infinity or -0
    payloads = np.array([0x7F800001, 0xFF800001, 0x7FFFFFFF, 0xFFFFFFFF], np.uint32)
    assert np.isnan(keep_mantissa_bits(payloads.view(np.float32), 10)).all()
    with pytest.raises(ValueError, match="keepbits"):
        keep_mantissa_bits(odd, 0)


def test_round_trip_of_values_labels_names_and_attributes_without_a_warning(tmp_path):
    distance = np.full((140, 250), np.inf)
    ds = scene(distance=distance, instance=np.arange(35000, dtype="u4").reshape(140, 250))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = store.write_store(
            tmp_path,
            "a",
            {"": ds, "truth/bayer": ds[["distance"]]},
            {"kind": "scene", "noise": np.float32(0.5), "objects": [{"distance_m": np.inf}]},
        )
        back = store.open_store(path)
        assert back.light_group.values.tolist() == ["sky", "street"]
    assert back.light_group.dtype == object
    assert np.abs(back.radiance.values / ds.radiance.values - 1).max() <= 2.0 ** -(KEEPBITS + 1)
    assert (
        np.array_equal(back.instance.values, ds.instance.values)
        and back.instance.dtype == np.uint32
    )
    assert np.array_equal(store.open_store(path, "truth/bayer").distance.values, distance)
    assert back.attrs["noise"] == 0.5 and back.attrs["objects"] == [{"distance_m": np.inf}]
    assert back.radiance.attrs == {"units": q.RADIANCE, "keepbits": KEEPBITS}
    q.check_scene(back)


def test_the_list_of_coordinates_is_no_attribute_of_the_data(tmp_path):
    ds = scene().assign_coords(exposure=0.01)
    path = store.write_store(tmp_path, "a", {"": ds, "copy": ds}, {})
    for group in ("", "copy"):
        back = store.open_store(path, group)
        assert "exposure" in back.coords and "coordinates" not in back.attrs


def test_all_bits_are_kept_on_request(tmp_path):
    ds = scene()
    back = store.open_store(store.write_store(tmp_path, "a", {"": ds}, {}, keepbits=None))
    assert np.array_equal(back.radiance.values, ds.radiance.values)


def test_layout_is_one_shard_per_group_of_whole_chunks(tmp_path):
    array = zarr.open_array(
        store.write_store(tmp_path, "a", {"": scene()}, {}) / "radiance", mode="r"
    )
    assert array.chunks == (1, 8, 135, 240) and array.shards == (1, 16, 270, 480)
    assert np.isnan(array.fill_value)
    assert len([p for p in (tmp_path / "a.zarr/radiance").glob("c.*")]) == 2
    assert tiling({"light_group": 4, "wavelength": 31, "y": 1080, "x": 1920})[1] == (
        1,
        32,
        1080,
        1920,
    )


def test_planes_without_bands_lie_in_few_even_chunks():
    assert tiling({"capture": 3, "y": 1386, "x": 2080}) == ((1, 462, 696), (1, 1386, 2088))
    # 15 columns of padding, not 959
    assert tiling({"y": 1, "x": 961, "xyz_channel": 3}) == (
        (1, 488, 1),
        (1, 976, 3),
    )


@pytest.mark.parametrize("rows", [1, 2, 27, 545])
@pytest.mark.parametrize("columns", [1, 47, 776, 970, 961])
@pytest.mark.parametrize("sizes", [{}, {"wavelength": 3}, {"capture": 2}])
def test_a_chunk_has_values_whose_bits_blosc_shuffles(sizes, rows, columns):
    """Blosc shuffles eight values at a time, and leaves blocks of other sizes unshuffled."""
    chunk, shard = tiling({**sizes, "y": rows, "x": columns})
    assert np.prod(chunk) % 8 == 0
    chunks_across = shard[-1] // chunk[-1]
    assert shard[-1] == chunks_across * chunk[-1] >= columns
    if "wavelength" not in sizes:  # bands are not divided evenly
        assert shard[-1] - columns <= 8 * chunks_across


def test_a_store_is_never_written_twice(tmp_path):
    first = store.write_store(tmp_path, "a", {"": scene()}, {"turn": 1})
    assert store.write_store(tmp_path, "a", {"": scene(seed=5)}, {"turn": 2}) == first
    assert store.read_attrs(first)["turn"] == 1
    assert (
        store.find_complete(tmp_path, "a") == first and store.find_complete(tmp_path, "b") is None
    )


WRITER = """
import sys, time; sys.path.insert(0, {here!r})
import test_store as t
from isethdr_core.storage import store
real = store._to_disk
def slow(path): print("written", flush=True); time.sleep({wait}); real(path)
store._to_disk = slow
print(store.write_store({folder!r}, "a", {{"": t.scene()}}, {{}}))
"""


def writer(folder, wait):
    code = WRITER.format(here=os.path.dirname(__file__), folder=str(folder), wait=wait)
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)


def test_a_killed_writer_leaves_no_store_and_the_next_one_cleans_up(tmp_path):
    child = writer(tmp_path, 60)
    assert child.stdout.readline().strip() == "written"
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    assert [p.suffix for p in tmp_path.iterdir()] == [".tmp"]
    store.write_store(tmp_path, "b", {"": scene()}, {})
    assert [p.name for p in tmp_path.iterdir()] == ["b.zarr"]


def test_every_file_is_on_the_disk_before_the_store_has_its_name(tmp_path, monkeypatch):
    asked = set()

    def fsync(handle):
        assert not (tmp_path / "s.zarr").exists(), "a power cut now would leave a whole name"
        asked.add(os.fstat(handle).st_ino)

    monkeypatch.setattr(os, "fsync", fsync)
    path = store.write_store(tmp_path, "s", {"": scene()}, {"kind": "scene"})
    files = {p for p in path.rglob("*") if p.is_file()}
    assert len(files) > 3 and asked == {p.stat().st_ino for p in files}


def test_a_writer_that_comes_second_returns_the_store_of_the_first(tmp_path, monkeypatch):
    """The second writer begins and ends between the last byte and the rename of the first."""
    to_disk = store._to_disk
    done = []

    def overtaken(path):
        monkeypatch.setattr(store, "_to_disk", to_disk)
        done.append(store.write_store(tmp_path, "a", {"": scene()}, {"writer": 2}))
        to_disk(path)

    monkeypatch.setattr(store, "_to_disk", overtaken)
    done.append(store.write_store(tmp_path, "a", {"": scene()}, {"writer": 1}))
    assert done == [tmp_path / "a.zarr"] * 2
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]
    assert store.read_attrs(tmp_path / "a.zarr")["writer"] == 2
    assert store.open_store(tmp_path / "a.zarr").radiance.notnull().all()


@pytest.mark.slow
def test_of_two_writers_one_wins_and_both_return_its_store(tmp_path):
    children = [writer(tmp_path, 1), writer(tmp_path, 1)]
    answers = [child.communicate(timeout=600)[0].split() for child in children]
    assert [a[-1] for a in answers] == [str(tmp_path / "a.zarr")] * 2
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]
    assert store.open_store(tmp_path / "a.zarr").radiance.notnull().all()


@pytest.mark.parametrize(
    "failure, message",
    [(errno.ENOSPC, "disk is full"), (errno.EROFS, "read-only"), (errno.EACCES, "no permission")],
)
def test_a_folder_that_cannot_be_written_is_a_clear_error_and_stays_clean(
    tmp_path, monkeypatch, failure, message
):
    def fail(path):
        raise OSError(failure, os.strerror(failure))

    monkeypatch.setattr(store, "_to_disk", fail)
    with pytest.raises(CatalogError, match=message):
        store.write_store(tmp_path, "a", {"": scene()}, {})
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(path):
        raise KeyboardInterrupt

    monkeypatch.setattr(store, "_to_disk", interrupt)
    with pytest.raises(KeyboardInterrupt):
        store.write_store(tmp_path, "a", {"": scene()}, {})
    assert list(tmp_path.iterdir()) == []


def test_light_with_a_hole_is_not_stored(tmp_path):
    ds = scene()
    ds.radiance.values[1, 3, 4, 5] = np.nan
    with pytest.raises(CatalogError, match="NaN at index 1"):
        store.write_store(tmp_path, "a", {"": ds}, {})
    assert list(tmp_path.iterdir()) == []


def test_incomplete_damaged_and_missing_stores_are_refused(tmp_path):
    path = store.write_store(tmp_path, "a", {"": scene()}, {})
    text = json.loads((path / "zarr.json").read_text())
    with pytest.raises(CatalogError, match="cannot open group 'nowhere'"):
        store.open_store(path, "nowhere")
    del text["attributes"]["complete"]
    (path / "zarr.json").write_text(json.dumps(text))
    with pytest.raises(CatalogError, match="incomplete.*isethdr catalog verify"):
        store.open_store(path)
    (path / "zarr.json").write_text('{"attri')
    with pytest.raises(CatalogError, match="damaged.*isethdr catalog verify"):
        store.write_store(tmp_path, "a", {"": scene()}, {})
    with pytest.raises(CatalogError, match="no store"):
        store.open_store(tmp_path / "none.zarr")


def test_a_flipped_bit_is_an_error_and_never_a_wrong_number(tmp_path):
    path = store.write_store(tmp_path, "a", {"": scene()}, {})
    chunk = path / "radiance/c.0.0.0.0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    chunk.write_bytes(data)
    from isethdr_catalog.verify import verify_store

    assert "radiance" in verify_store(path).problems[0]
    chunk.unlink()
    assert "radiance/c.0.0.0.0 is missing" in verify_store(path).problems[0]


def test_siblings_are_joined_and_only_what_is_used_is_read(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    a = scene(("sky", "street"))
    b = scene(("headlights", "sky"), seed=3)
    for name, ds in (("r1-a", a), ("r1-b", b)):
        store.write_store(
            tmp_path / "scenes",
            name,
            {"": ds},
            {"recipe": "r1", "noise": {g: name for g in ds.light_group.values}},
        )
    store.write_store(tmp_path / "scenes", "r2", {"": b}, {"recipe": "r2"})
    read = []
    real = zarr.storage.LocalStore.get

    async def spy(self, key, *args, **kwargs):
        if "radiance/c." in key:
            read.append(f"{self.root.name}/{key}")
        return await real(self, key, *args, **kwargs)

    monkeypatch.setattr(zarr.storage.LocalStore, "get", spy)
    joined = store.open_scene("r1")
    assert joined.light_group.values.tolist() == ["sky", "street", "headlights"] and read == []
    head = joined.radiance.sel(light_group="headlights").values
    assert (
        head.shape == b.radiance.shape[1:]
        and {r.split("/c.")[1][0] for r in read} == {"0"}
        and all("r1-b" in r for r in read)
    )
    assert np.array_equal(head, keep_mantissa_bits(b.radiance.values[0]))
    assert np.array_equal(
        joined.radiance[[2, 0], 3:5, ::7, [1, 5]].values,
        joined.radiance.values[[2, 0]][:, 3:5, ::7][..., [1, 5]],
    )
    assert joined.attrs["noise"] == {"sky": "r1-a", "street": "r1-a", "headlights": "r1-b"}
    with pytest.raises(CatalogError, match="could be any of"):
        store.open_scene("r")
    with pytest.raises(CatalogError, match="no scene"):
        store.open_scene("zzz")


def test_a_scene_is_opened_without_reading_those_of_other_recipes(tmp_path, monkeypatch):
    """The scene is opened by its whole name. A dataset of a thousand scenes opens each of them
    several times.
    """
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    folder = tmp_path / "scenes"
    parts = {"r1-a": scene(("sky",)), "r1-b": scene(("street",)), "r2-a": scene(("sky",))}
    for name, ds in parts.items():
        store.write_store(folder, name, {"": ds}, {"recipe": name[:2]})
    read = set()
    real = store.read_attrs
    monkeypatch.setattr(store, "read_attrs", lambda path: read.add(path.stem) or real(path))
    joined = store.open_scene("r1-a")
    assert sorted(joined.light_group.values) == ["sky", "street"]
    assert read == {"r1-a", "r1-b"}


def stored_scenes(folder, **parts):
    """Store each part under its name, all of the recipe r1."""
    for name, ds in parts.items():
        store.write_store(folder, name, {"": ds}, {"recipe": "r1"})
    return [store.open_store(folder / f"{name}.zarr") for name in parts]


def test_groups_that_are_wanted_decide_which_bands_are_joined(tmp_path):
    a = scene(("sky",))
    b = scene(("street",)).isel(wavelength=slice(2, 5))
    joined = join_scenes(stored_scenes(tmp_path, a=a, b=b), ("sky", "street"))
    assert joined.radiance.shape == (2, 3, 140, 250)
    assert np.array_equal(joined.radiance[0].values, keep_mantissa_bits(a.radiance.values[0, 2:5]))
    alone = join_scenes(stored_scenes(tmp_path, a=a, b=b), ("sky",))
    assert (
        alone.light_group.values.tolist() == ["sky"]
        and alone.sizes["wavelength"] == a.sizes["wavelength"]
    )


def test_siblings_are_joined_along_the_bands(tmp_path):
    whole = scene(("sky", "street"))
    odd = whole.isel(wavelength=slice(1, None, 2))
    even = whole.isel(wavelength=slice(0, None, 2))
    other = scene(("headlights",), seed=5)
    stored_scenes(tmp_path, even=even, odd=odd, other=other)
    joined = store.open_scene(tmp_path / "even.zarr")
    # headlights are stored at all bands, so that all three groups are joined at all bands
    assert joined.light_group.values.tolist() == ["sky", "street", "headlights"]
    assert (
        np.array_equal(joined.wavelength.values, whole.wavelength.values)
        and joined.wavelength.attrs["units"] == "nm"
    )
    want = keep_mantissa_bits(np.concatenate([whole.radiance.values, other.radiance.values]))
    assert np.array_equal(joined.radiance.values, want)
    part = joined.radiance
    assert np.array_equal(part[1, 3].values, want[1, 3])
    assert np.array_equal(part[:, 1:4, 7, [8, 2]].values, want[:, 1:4, 7][..., [8, 2]])
    assert np.array_equal(part[[2, 0], [0, 3, 1], 5].values, want[[2, 0]][:, [0, 3, 1], 5])
    assert part[:0, :2].values.shape == (0, 2, 140, 250)


def test_a_sibling_with_bands_of_one_group_only_does_not_take_the_other_group_away(tmp_path):
    whole = scene(("sky", "street"))
    few = whole.isel(wavelength=[1, 3])
    more = whole.isel(light_group=[0])
    stored_scenes(tmp_path, few=few, more=more)
    joined = store.open_scene(tmp_path / "few.zarr")
    assert joined.radiance.shape[:2] == (2, 2)  # street is known at two bands
    joined = store.open_scene(tmp_path / "more.zarr")
    assert (
        joined.light_group.values.tolist() == ["sky"]
        and joined.sizes["wavelength"] == whole.sizes["wavelength"]
    )


def test_content_hash_names_content_not_order():
    assert store.content_hash({"a": 1, "b": (1.0, None)}) == store.content_hash(
        {"b": [1.0, None], "a": np.int64(1)}
    )
    assert store.content_hash({"a": 1}) != store.content_hash({"a": 2})
    assert len(store.content_hash({})) == 16
    with pytest.raises(TypeError, match="cannot be written as JSON"):
        store.content_hash(object())


def test_numbers_beyond_json_come_back():
    value = {"a": [float("inf"), -float("inf"), 1.5], "b": "text"}
    assert restored(json.loads(json.dumps(jsonable(value), allow_nan=False))) == value


@pytest.mark.filterwarnings("error")
def test_plain_xarray_opens_a_store_without_a_warning(tmp_path):
    pictures = {
        name: xr.Dataset({"xyz": (("y", "x"), np.full((2, 3), value))}, attrs={"units": "cd m-2"})
        for name, value in (("", 1.0), ("picture/a", 2.0), ("truth/a", 3.0))
    }
    path = store.write_store(tmp_path, "run", pictures, {"kind": "run"})
    assert float(xr.open_zarr(path)["xyz"][1, 2]) == 1.0
    assert float(xr.open_zarr(path, group="picture/a")["xyz"][1, 2]) == 2.0
    assert float(xr.open_dataset(path, engine="zarr", group="truth/a")["xyz"][0, 0]) == 3.0
    tree = xr.open_datatree(path, engine="zarr")
    assert set(tree.groups) == {"/", "/picture", "/picture/a", "/truth", "/truth/a"}
    assert float(tree["truth/a/xyz"][0, 0]) == 3.0


def test_a_scene_without_any_wanted_group_is_one_clear_error(tmp_path):
    stored = stored_scenes(tmp_path, a=scene(("sky",)))
    with pytest.raises(ConfigError, match="no light of the groups street; .* some of sky"):
        join_scenes(stored, ("street",))
