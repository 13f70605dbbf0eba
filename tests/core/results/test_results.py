"""Stored runs in Python: opened by name, drawn the right way up, shown with every name escaped."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr

import isethdr
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.results.plot import extent_mm
from isethdr_core.runs.labels import Labels, add_labels
from isethdr_core.storage.store import write_store

from ..sweeps.stored_sweep import attributes


def picture(bright_row: int) -> xr.Dataset:
    """Return a picture of 4 x 6 pixels of 3 um in which one row is bright."""
    y = 3e-6 * (np.arange(4) - 1.5)
    x = 3e-6 * (np.arange(6) - 2.5)
    xyz = np.full((4, 6, 3), 1.0)
    xyz[bright_row] = 100.0
    dims = ("y", "x", "xyz_channel")
    return xr.Dataset(
        {"xyz": (dims, xyz), "valid": (dims[:2], np.ones((4, 6), bool))},
        {"y": y, "x": x, "xyz_channel": np.array(["X", "Y", "Z"], object)},
    )


@pytest.fixture
def stored(isethdr_home):
    """Return the path of a stored run with one camera; the run has the name `first`."""
    groups = {f"picture/{'cam'}": picture(0), f"truth/{'cam'}": picture(0)}
    record = attributes("1f3a", "cam", (0.5, 0.4, 0.6), 1.0)
    path = write_store(isethdr_home / "runs", "1f3a", groups, record)
    add_labels(path, Labels("first"))
    return path


def test_a_run_opens_by_digits_name_or_path(stored):
    for name in ("1f", "1f3a", "first", stored):
        assert isethdr.open_run(name).key == "1f3a"
    with pytest.raises(CatalogError, match=r"'2b' names no run.*one of: 1f3a"):
        isethdr.open_run("2b")
    with pytest.raises(CatalogError, match="names no run"):
        isethdr.open_run("")
    with pytest.raises(CatalogError, match=r"s3://b/runs/1f.zarr is an address; .*home='s3://"):
        isethdr.open_run("s3://b/runs/1f.zarr")
    run = isethdr.open_run("1f")
    assert repr(run) == f"Result({str(run.path)!r}, computed=False)"


def test_a_plot_is_the_right_way_up_with_units(stored):
    run = isethdr.open_run("first")
    assert extent_mm(run.open("picture/cam")) == pytest.approx((-0.009, 0.009, 0.006, -0.006))
    [panel] = run.plot().axes
    assert panel.get_xlabel().endswith("mm") and panel.get_ylabel() == "y (down), mm"
    bottom, top = panel.get_ylim()
    assert top < 0 < bottom, "y points down, and the first row is drawn at the top"
    [image] = panel.get_images()
    assert image.origin == "upper" and image.get_array()[0].mean() > image.get_array()[1:].max()
    luminance, bar = run.plot(of="luminance").axes
    assert run.plot()._repr_png_().startswith(b"\x89PNG")
    assert bar.get_ylabel() == "luminance, cd/m²"
    assert luminance.get_images()[0].get_array().max() == 100.0
    with pytest.raises(ConfigError, match="did you mean 'luminance'"):
        run.plot(of="luminanc")


def test_the_html_of_a_run_holds_its_picture_and_scores_with_names_escaped(stored):
    run = isethdr.open_run("first")
    shown = run._repr_html_()
    assert "data:image/png" in shown and "0.5 ± 0.1" in shown and "run first 1f3a" in shown
    run.attributes["scores"][0]["metric"] = "<script>"
    assert "<script>" not in run._repr_html_()


def test_find_show_and_compare(stored):
    rows = isethdr.find(kind="run", ssim__ge=0.1)
    assert [row["id"] for row in rows] == ["1f3a"] and "<td>0.5</td>" in rows._repr_html_()
    assert "nothing found" in isethdr.find(kind="run", ssim__ge=0.9)._repr_html_()
    assert isethdr.show("first")["key"] == "1f3a"
    same = isethdr.compare("first", "1f3a")
    assert not same.settings and "ssim" in same._repr_html_()


def test_plain_xarray_opens_a_store_without_warnings(stored):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plain = xr.open_zarr(stored, group="picture/cam", consolidated=False, chunks=None)
    # a picture without variance is rounded by at most 8e-6 (docs/how-to/catalog.md)
    np.testing.assert_allclose(plain.xyz.values, picture(0).xyz.values, rtol=8e-6)
