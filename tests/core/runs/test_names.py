"""Names that become folders cannot leave a store: refused when the chain is built, and when a store
is written.
"""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from omegaconf import open_dict

from isethdr_core import compose
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.names import LONGEST_BYTES, check_names, check_path
from isethdr_core.storage import store

LEAVING = (
    "../x",
    "..",
    ".",
    "",
    "/etc",
    "a/b",
    "a\\b",
    "C:",
    "C:\\x",
    "a\0b",
    "a\nb",
    "x" * 101,
    "ä" * 51,
    "\ud800",
)
RESERVED = (
    "zarr.json",
    "NUL",
    "com1",
    "aux.txt",
    "__x",
    "ends.",
    "ends ",
    " begins",
    "a*",
    "a?",
    'a"b',
    "a|b",
    "<a>",
)
FINE = (
    "bayer",
    "front_left",
    "front-left.2",
    "Kamera vorn",
    "鱼眼",
    "x" * LONGEST_BYTES,
    "...a",
    "comma",
    "1",
)


@pytest.mark.parametrize("name", [*LEAVING, *RESERVED])
def test_a_name_that_no_folder_can_have_is_refused(name):
    with pytest.raises(ConfigError, match="the camera name .*; expected letters"):
        check_names("camera", ["bayer", name])


@pytest.mark.parametrize("name", FINE)
def test_other_names_are_left_alone(name):
    check_names("camera", [name])
    check_path(f"captures/{name}")


@pytest.fixture(scope="module")
def composed():
    return compose(["scene=uniform", "sensor=ideal"])


def with_entry(composed, table, name, entry):
    """Return a config with `entry` under `name` in one of its tables."""
    config = composed.copy()
    with open_dict(config):
        if table == "cameras":
            config.pop("sensor")
        config[table] = {name: entry}
    return config


@pytest.mark.parametrize("table", ["cameras", "versions", "flare", "metric"])
def test_the_chain_is_not_built_with_such_a_name(composed, table):
    entries = {"cameras": composed.sensor, "versions": composed.lighting}
    entry = entries.get(table, {"name": "ideal"})
    for name in LEAVING[::5]:
        with pytest.raises(ConfigError, match=r"the (camera|version|flare|metric) name "):
            chain(with_entry(composed, table, name, entry))
    chain(with_entry(composed, table, 7, entry))  # OmegaConf allows numbers as names


def test_the_shown_lighting_keeps_its_name(composed):
    with pytest.raises(ConfigError, match="lighting version is called 'main'"):
        chain(with_entry(composed, "versions", "main", composed.lighting))


@pytest.mark.parametrize(
    "path", ["../x", "a/../../x", "/x", "a//b", "a/", "a/..", "a/b\0", "C:/x", "a\\..\\b"]
)
def test_the_writer_refuses_groups_that_leave_the_store(tmp_path, path):
    with pytest.raises(CatalogError, match="cannot be stored"):
        store.write_store(
            tmp_path / "in", "s", {path: xr.Dataset({"a": ("x", np.arange(3.0))})}, {}
        )
    assert list(tmp_path.rglob("*")) == []


@pytest.mark.parametrize("name", ["../s", "a/s", "", "..", "a\0"])
def test_the_writer_refuses_stores_that_leave_the_folder(tmp_path, name):
    with pytest.raises(CatalogError, match="cannot be stored"):
        store.write_store(tmp_path / "in", name, {"": xr.Dataset()}, {})
    assert list(tmp_path.rglob("*")) == []


@pytest.mark.parametrize("name", ["../a", "a/b", "..", "zarr.json"])
def test_the_writer_refuses_arrays_that_leave_their_group(tmp_path, name):
    with pytest.raises(CatalogError, match="cannot be stored"):
        store.write_store(
            tmp_path, "s", {"captures/bayer": xr.Dataset({name: ("x", np.arange(3.0))})}, {}
        )
    assert list(tmp_path.rglob("*")) == []
