"""Arrays of a stored picture that are derived from others, or have another type."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from isethdr_catalog import dataset
from isethdr_catalog.selection import StoredShot


def array_of(monkeypatch, tmp_path, product, data):
    """Return a product of a store that holds `data`."""
    monkeypatch.setattr(dataset, "open_store", lambda *_: data)
    return dataset.array_of(StoredShot(tmp_path / "a.zarr", "camera"), product)


def test_a_labelled_picture_without_objects_has_no_category_in_any_pixel(monkeypatch, tmp_path):
    instance = ("y", "x"), np.zeros((4, 5), np.uint32)
    truth = xr.Dataset({"instance": instance}, attrs={"objects": []})
    category = array_of(monkeypatch, tmp_path, "category", truth)
    assert category.dtype == np.int32 and category.shape == (4, 5) and not category.any()
    assert array_of(monkeypatch, tmp_path, "boxes", truth).shape == (0, 4)


@pytest.mark.parametrize(
    "values, dtype",
    [
        (np.array([[[-1.5, 2.25]]], np.float32), np.float32),
        (np.array([[[0, 2**24 - 1]]], np.uint32), np.int32),
    ],
)
def test_raw_values_keep_the_fractions_of_electrons(monkeypatch, tmp_path, values, dtype):
    captures = xr.Dataset({"raw": (("capture", "y", "x"), values)})
    raw = array_of(monkeypatch, tmp_path, "raw", captures)
    assert raw.dtype == dtype
    np.testing.assert_array_equal(raw, values)
