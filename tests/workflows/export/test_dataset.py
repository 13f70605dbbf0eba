"""Stored pictures as a dataset: items by name and query, types, laziness, copies for workers."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from isethdr_catalog import dataset
from isethdr_catalog.dataset import PRODUCTS

import isethdr
from isethdr_core.data.categories import CATEGORIES
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.results.stored import open_run

from .stored_runs import COLUMNS, LABELLED, ROWS


def test_items_are_arrays_of_stored_runs(home):
    data = isethdr.PictureDataset(
        LABELLED, products=PRODUCTS.keys() - {"distance", "depth", "normal"}
    )
    assert len(data) == 1 and data[0].keys() == {"run", "camera", *data.products}
    item = data[0]
    run = open_run(LABELLED)
    assert (item["run"], item["camera"]) == (LABELLED, "bayer")
    for product in data.products:
        assert item[product].dtype == PRODUCTS[product].dtype and item[product].flags.writeable
    truth = run.open("truth/bayer")
    np.testing.assert_array_equal(item["picture"], run.open("picture/bayer")["xyz"].values)
    np.testing.assert_array_equal(item["truth"], truth["xyz"].values)
    np.testing.assert_array_equal(item["raw"], run.open("captures/bayer")["raw"].values)
    np.testing.assert_array_equal(item["instance"], truth["instance"].values)
    by_instance = [0, CATEGORIES["car"], CATEGORIES["person"], CATEGORIES["road"]]
    np.testing.assert_array_equal(item["category"], np.array(by_instance)[item["instance"]])
    things = truth.attrs["objects"][:2]  # without the road
    assert item["boxes"].tolist() == [row["box"] for row in things]
    assert item["labels"].tolist() == by_instance[1:3]
    assert item["display"].shape == (ROWS, COLUMNS, 3)


def test_items_are_found_by_query_or_by_name(home):
    keys = lambda data: [item["run"] for item in data]
    both = sorted([home.plain, LABELLED])
    assert keys(isethdr.PictureDataset("two")) == keys(isethdr.PictureDataset()) == both
    assert keys(isethdr.PictureDataset(sensor="bayer", lighting="night")) == [LABELLED]
    assert isethdr.PictureDataset("two")[-1]["run"] == both[-1]
    with pytest.raises(IndexError):
        isethdr.PictureDataset("two")[2]
    with pytest.raises(ConfigError, match="'two' and conditions are given"):
        isethdr.PictureDataset("two", sensor="bayer")
    with pytest.raises(CatalogError, match="nothing in .* meets sensor=rgbw"):
        isethdr.PictureDataset(sensor="rgbw")
    with pytest.raises(ConfigError, match="no product 'pictur'; did you mean 'picture'"):
        isethdr.PictureDataset("two", products=["pictur"])


def test_a_product_that_a_run_lacks_is_named(home):
    for product in ("instance", "category", "depth"):
        data = isethdr.PictureDataset(home.plain, products=[product])
        with pytest.raises(CatalogError, match=f"run {home.plain} holds no {product} for camera"):
            data[0]
    data = isethdr.PictureDataset(home.plain, products=["boxes", "labels"])
    assert data[0]["boxes"].shape == (0, 4) and data[0]["labels"].shape == (0,)


def crop(item):
    """Return a part of the picture. As a function of a module, it can be pickled."""
    return item["picture"][2:6, 3:5]


def test_a_copy_for_a_worker_reads_the_same(home, tmp_path, monkeypatch):
    data = isethdr.PictureDataset("two", transform=crop)
    content = pickle.dumps(data)
    assert len(content) < 2000, "names of files and no arrays"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    copy = pickle.loads(content)
    assert len(copy) == 2 and copy[0].shape == (4, 2, 3)
    np.testing.assert_array_equal(copy[1], data[1])


def test_kept_arrays_are_mapped_into_memory(home, tmp_path, monkeypatch):
    plain = isethdr.PictureDataset("two")
    data = isethdr.PictureDataset("two", cache=tmp_path / "kept")
    first = data[0]["picture"]
    assert len(list((tmp_path / "kept").glob("*.npy"))) == 2, "of one item"
    list(data)
    monkeypatch.setattr(dataset, "open_store", lambda *_: pytest.fail("the store was read"))
    again = data[0]["picture"]
    assert isinstance(again, np.memmap) and again.flags.writeable
    again[:] = 0
    np.testing.assert_array_equal(data[0]["picture"], first)
    monkeypatch.undo()
    monkeypatch.setenv("ISETHDR_HOME", str(home.folder))
    np.testing.assert_array_equal(plain[0]["picture"], first)


def test_kept_boxes_of_an_earlier_version_are_not_read(home, tmp_path):
    """They held all objects, the road as well; their labels may be new."""
    for product, of_all in (("boxes", np.zeros((3, 4))), ("labels", np.zeros(3))):
        np.save(tmp_path / f"{LABELLED}_bayer_{product}.npy", of_all)
    plain = isethdr.PictureDataset(LABELLED, products=["boxes", "labels"])[0]
    data = isethdr.PictureDataset(LABELLED, products=["boxes", "labels"], cache=tmp_path)
    for item in (data[0], data[0]):
        assert item["boxes"].shape == (2, 4)
        for product in ("boxes", "labels"):
            np.testing.assert_array_equal(item[product], plain[product])


@pytest.mark.slow
@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_torch_loads_it_with_workers(home, tmp_path, start):
    loaders = pytest.importorskip("torch.utils.data", reason="no dependency of isethdr")
    data = isethdr.PictureDataset("two", products=["picture", "raw"], cache=tmp_path / "kept")
    loader = loaders.DataLoader(data, 2, num_workers=2, multiprocessing_context=start)
    [batch] = loader
    assert batch["run"] == [item["run"] for item in data]
    for product in data.products:
        expected = np.stack([item[product] for item in data])
        np.testing.assert_array_equal(batch[product].numpy(), expected)
