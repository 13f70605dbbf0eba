"""Import of a folder tree of the ISETHDR data deposit, from small files in its layout."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.iset_import import importing
from isethdr_scenes.iset_import.importing import run
from isethdr_scenes.iset_import.tree import scan
from isethdr_scenes.pictures.picture_file import PictureFile
from scipy.io import savemat

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.store import open_scene

BANDS = range(400, 701, 10)
SHAPE = (2, 3)


def write_exr(path, channels):
    """Write channels (y, x) as EXR."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def write_scene(folder, scene_id, names=("skymap", "headlights"), level=1.0):
    """Write a scene; the light of a band is `level` x number of the group x number of the band."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, name in enumerate(names, 1):
        channels = {
            f"S0.{nm},000nm": np.full(SHAPE, level * k * (1 + b), np.float32)
            for b, nm in enumerate(BANDS)
        }
        write_exr(folder / f"{scene_id}_{name}.exr", channels)
    instance = np.arange(6, dtype=np.float32).reshape(SHAPE)
    write_exr(folder / f"{scene_id}_instanceID.exr", {"InstanceId": instance})
    savemat(folder / f"{scene_id}.mat", {"sceneMeta": {"depthMap": 5.0 + instance}})


@pytest.fixture
def tree(tmp_path):
    """Return a tree with three scenes, two of them in one folder, and other files."""
    root = tmp_path / "deposit"
    write_scene(root / "data" / "1112184733", "1112184733")
    write_scene(root / "data" / "two", "1113094429", names=("streetlights",))
    write_scene(root / "data" / "two", "1114031438", level=2.0)
    (root / "data" / "two" / "1114031438.mat").unlink()
    (root / "README.md").write_text("about")
    savemat(root / "data" / "oiTunnel.mat", {"oi": 1})
    write_exr(
        root / "data" / "1115000000_instanceID.exr", {"InstanceId": np.ones(SHAPE, np.float32)}
    )
    write_exr(root / "data" / "teaser.exr", {"Y": np.ones(SHAPE, np.float32)})
    return root


def stores(home):
    """Return the stored scenes by their id in the deposit."""
    found = [open_scene(path) for path in sorted((home / "scenes").glob("*.zarr"))]
    return {data.attrs["scene_id"]: data for data in found}


def test_scenes_and_other_files_are_told_apart(tree):
    scenes, skipped = scan(tree)
    assert [(s.scene_id, len(s.files)) for s in scenes] == [
        ("1112184733", 4),
        ("1113094429", 3),
        ("1114031438", 3),
    ]
    assert {s.path.name: s.why for s in skipped} == {
        "README.md": "no file of a scene",
        "oiTunnel.mat": "MATLAB file without radiance beside it",
        "1115000000_instanceID.exr": "instance map without radiance beside it",
        "teaser.exr": "EXR file with another name than <id>_<group>.exr",
    }


def test_a_tree_is_stored_with_its_labels(tree, isethdr_home, capsys):
    assert run(str(tree), 40.0, 0.0, look=False) == 0
    shown = capsys.readouterr().out
    assert "3 stored" in shown and "oiTunnel.mat" in shown and "README.md" in shown
    found = stores(isethdr_home)
    assert found.keys() == {"1112184733", "1113094429", "1114031438"}
    first = found["1112184733"]
    assert list(first["light_group"].values) == ["sky", "headlights"]
    for k, light in enumerate(first["radiance"].values, 1):  # small integers are stored exactly
        np.testing.assert_array_equal(light[:, 0, 0], k * (1.0 + np.arange(31)))
    assert first["instance"].values[1, 2] == 5 and first["distance"].values[1, 2] == 10.0
    assert first.attrs["field_width"] == pytest.approx(2 * np.tan(np.radians(20)))
    assert list(found["1113094429"]["light_group"].values) == ["streetlights"]
    assert "distance" not in found["1114031438"], "its MATLAB file is not there"


def test_a_second_call_reads_nothing_again(tree, isethdr_home, capsys, monkeypatch):
    run(str(tree), 40.0, 0.0, look=False)
    one = next((isethdr_home / "scenes").glob("*.zarr"))
    one.rename(one.with_suffix(".gone"))
    capsys.readouterr()
    run(str(tree), 40.0, 0.0, look=False)
    assert "2 already stored, 1 stored" in capsys.readouterr().out
    monkeypatch.setattr(importing, "_digests", lambda paths: pytest.fail("files were read"))
    run(str(tree), 40.0, 0.0, look=False)
    assert "3 already stored" in capsys.readouterr().out


def test_a_changed_file_and_another_field_make_other_stores(tree, isethdr_home, capsys):
    run(str(tree), 40.0, 0.0, look=False)
    write_scene(tree / "data" / "1112184733", "1112184733", level=3.0)
    run(str(tree), 40.0, 0.0, look=False)
    assert "2 already stored, 1 stored" in capsys.readouterr().out
    run(str(tree), 45.0, 0.0, look=False)
    assert len(list((isethdr_home / "scenes").glob("*.zarr"))) == 7


def test_a_wrong_file_is_named_and_the_rest_is_stored(tree, isethdr_home, capsys):
    path = tree / "data" / "1112184733" / "1112184733_headlights.exr"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    other = tree / "data" / "two" / "1114031438_skymap.exr"
    write_exr(other, {f"S0.{nm},000nm": np.full(SHAPE, -1.0, np.float32) for nm in BANDS})
    assert run(str(tree), 40.0, 0.0, look=False) == 2
    shown = capsys.readouterr()
    assert "1 stored, 2 wrong" in shown.out and stores(isethdr_home).keys() == {"1113094429"}
    assert "scene 1112184733: " in shown.err and "headlights.exr is not a readable EXR" in shown.err
    assert "scene 1114031438: " in shown.err and "never negative" in shown.err
    path.write_bytes(content)
    assert run(str(tree), 40.0, 0.0, look=False) == 1
    assert stores(isethdr_home).keys() == {"1112184733", "1113094429"}


def test_a_list_stores_nothing(tree, isethdr_home, capsys):
    assert run(str(tree), 40.0, 0.0, look=True) == 0
    shown = capsys.readouterr().out
    assert "data/two" in shown and "teaser.exr" in shown and not isethdr_home.exists()


def test_bad_input_is_one_error(tree, tmp_path):
    with pytest.raises(CatalogError, match="nowhere is not a folder"):
        run(str(tmp_path / "nowhere"), 40.0, 0.0, look=False)
    (tmp_path / "empty").mkdir()
    with pytest.raises(CatalogError, match="hold no scene; expected files such as"):
        run(str(tmp_path / "empty"), 40.0, 0.0, look=False)
    with pytest.raises(ConfigError, match="horizontal_field_deg"):
        run(str(tree), 400.0, 0.0, look=False)


def test_a_stored_scene_is_the_scene_of_a_run(tree, isethdr_home):
    """`scene=file` reads the store with all light groups, as docs/how-to/export.md says."""
    run(str(tree), 40.0, 0.0, look=False)
    [path] = [
        p
        for p in (isethdr_home / "scenes").glob("*.zarr")
        if "1112184733" in str(open_scene(p).attrs["scene_id"])
    ]
    scene = PictureFile(str(path), horizontal_field_deg=40.0)()
    np.testing.assert_array_equal(scene["radiance"].values, open_scene(path)["radiance"].values)
    assert list(scene["light_group"].values) == ["sky", "headlights"]
