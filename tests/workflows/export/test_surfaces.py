"""Exported depth, distance and normals are the stored values; the sky is infinitely far."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest
from isethdr_workflows.export.exporting import exported
from isethdr_workflows.export.job import Job
from isethdr_workflows.export.labels import surfaces

from isethdr_core.errors import CatalogError
from isethdr_core.results.stored import open_run
from isethdr_core.storage.store import write_store

from .stored_runs import LABELLED, SCENE, scene
from .stored_runs import surfaces as stored_surfaces


def channels(path) -> tuple[dict[str, np.ndarray], dict]:
    """Return the channels and the header of an EXR file."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        pixels = {name: one.pixels.copy() for name, one in file.channels().items()}
        return pixels, dict(file.header())


def test_depth_and_normals_of_a_run_are_those_of_the_store(home, tmp_path):
    exported([LABELLED], tmp_path / "out", ["depth,normals"])
    truth = open_run(LABELLED).open("truth/bayer")
    found, header = channels(tmp_path / "out" / "depth" / f"{LABELLED}_bayer.exr")
    assert header["units"] == "m" and found.keys() == {"depth", "distance"}
    for name, value in found.items():
        assert value.dtype == np.float32
        np.testing.assert_array_equal(value, truth[name].values)
        assert np.isposinf(value[0]).all() and np.isfinite(value[1:]).all()
    found, _ = channels(tmp_path / "out" / "normals" / f"{LABELLED}_bayer.exr")
    for k, axis in enumerate("xyz"):
        np.testing.assert_array_equal(found[f"normal.{axis}"], truth["normal"].values[..., k])


def test_labels_of_a_stored_scene_need_no_run(home, tmp_path):
    exported(["kind=scene"], tmp_path / "out", ["depth,normals"])
    expected = stored_surfaces(3, 4)
    found, header = channels(tmp_path / "out" / "depth" / f"{SCENE[:16]}.exr")
    assert header["fieldWidth"] == pytest.approx(0.4) and header["projection"] == "tangent"
    np.testing.assert_array_equal(found["distance"], expected["distance"])
    found, _ = channels(tmp_path / "out" / "normals" / f"{SCENE[:16]}.exr")
    np.testing.assert_array_equal(found["normal.x"], expected["normal"][..., 0])


def test_a_run_or_a_scene_without_labels_is_refused_in_one_line(home, tmp_path):
    # no run of such a scene has labels, so the message asks for another scene
    said = (
        f"run {home.plain} has no depth for camera bayer, .*states its own radiance.*scene=street"
    )
    with pytest.raises(CatalogError, match=said) as no:
        exported([home.plain], tmp_path / "out", ["png,depth"])
    assert "\n" not in str(no.value) and not (tmp_path / "out").exists()
    bare = scene().drop_vars("normal")
    path = write_store(tmp_path / "scenes", "5ce4e00000000001-00000000", {"": bare}, {})
    job = Job([], [path], tmp_path, "", "", "2026-01-01", format="normals")
    with pytest.raises(CatalogError, match="scene 5ce4e00000000001-00000000 has no normal"):
        surfaces.check(job)
