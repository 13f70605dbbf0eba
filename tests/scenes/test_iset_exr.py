"""Reading a scene of the ISETHDR data deposit, from files in its layout that the tests write."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes import iset_exr_files
from isethdr_scenes.iset_exr import IsetExr
from scipy.io import savemat

from isethdr_core.cli.plan_summary import print_plan
from isethdr_core.data import quantities
from isethdr_core.errors import CatalogError, ConfigError, UnitError
from isethdr_core.physics.photometry import luminance
from isethdr_core.uncertainty import ledger

BANDS = range(400, 701, 10)
NAMES = {
    "sky": "skymap",
    "headlights": "headlights",
    "streetlights": "streetlights",
    "other": "otherlights",
}
SHAPE = (18, 32)


def write(path, channels):
    import OpenEXR

    with OpenEXR.File(
        {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, dict(channels)
    ) as file:
        file.write(str(path))


@pytest.fixture
def deposit(tmp_path):
    """Write one scene; return its folder and its light {group: (wavelength, y, x)}."""
    rng = np.random.default_rng(5)
    light = {g: 10 ** rng.uniform(-6, 5, (31, *SHAPE)).astype(np.float32) for g in NAMES}
    for group, name in NAMES.items():
        write(
            tmp_path / f"1112184733_{name}.exr",
            {f"S0.{nm},000nm": light[group][k] for k, nm in enumerate(BANDS)},
        )
    instance = np.arange(np.prod(SHAPE), dtype=np.float32).reshape(SHAPE)
    write(tmp_path / "1112184733_instanceID.exr", {"InstanceId": instance})
    savemat(
        tmp_path / "1112184733.mat",
        {"sceneMeta": {"depthMap": 5.0 + instance.astype(float), "datasetFolder": "x"}},
    )
    return tmp_path, light


def test_radiance_comes_back_bit_for_bit_with_labels(deposit):
    folder, light = deposit
    ds = IsetExr(str(folder), "1112184733")()
    for group in NAMES:
        np.testing.assert_array_equal(ds.radiance.sel(light_group=group), light[group])
    assert list(ds.wavelength.values) == list(BANDS)
    assert ds.attrs["field_width"] == pytest.approx(2 * np.tan(np.radians(20)), rel=1e-12)
    assert ds.attrs["field_height"] == pytest.approx(ds.attrs["field_width"] * 18 / 32, rel=1e-12)
    assert quantities.tile_pitch(ds, "x") == pytest.approx(
        quantities.tile_pitch(ds, "y"), rel=1e-12
    )
    assert ds.instance.dtype == np.uint32 and ds.instance.values[1, 0] == SHAPE[1]
    np.testing.assert_array_equal(ds.distance, 5.0 + ds.instance.values)


def test_isets_normalisation_brings_every_group_to_its_mean(deposit):
    folder, _ = deposit
    ds = IsetExr(str(folder), "1112184733", normalise_cd_m2=100.0)()
    for k in range(4):
        y = luminance(ds.radiance.values[k].astype(float), ds.wavelength.values)
        assert y.mean() == pytest.approx(100.0, rel=1e-6)  # float32 light and a float32 factor


def test_missing_groups_and_labels_are_dropped_and_said(deposit):
    folder, light = deposit
    (folder / "1112184733_streetlights.exr").unlink()
    (folder / "1112184733_instanceID.exr").unlink()
    # the first bytes of a version 7.3 MAT file: a text, then version 0x0200
    (folder / "1112184733.mat").write_bytes(
        b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400)
    )
    book = ledger.Ledger()
    with ledger.stage(book, "scene"):
        ds = IsetExr(str(folder), "1112184733")()
    assert list(ds.light_group.values) == ["sky", "headlights", "other"]
    np.testing.assert_array_equal(ds.radiance.sel(light_group="other"), light["other"])
    said = {row.what: row.why for row in book[0].left_out}
    assert set(said) == {"group streetlights", "label instance", "label distance"}
    assert "7.3" in said["label distance"] and "streetlights.exr" in said["group streetlights"]


@pytest.mark.parametrize("kept", [0.0, 0.02, 0.5, 0.999])
def test_a_cut_off_file_is_named(deposit, kept):
    folder, _ = deposit
    path = folder / "1112184733_headlights.exr"
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(CatalogError, match="1112184733_headlights.exr.*cut off"):
        IsetExr(str(folder), "1112184733")()


def test_a_missing_channel_or_bad_light_is_named(deposit):
    folder, light = deposit
    path = folder / "1112184733_skymap.exr"
    channels = {f"S0.{nm},000nm": light["sky"][k].copy() for k, nm in enumerate(BANDS)}
    write(path, {k: v for k, v in channels.items() if "550" not in k})
    with pytest.raises(CatalogError, match="skymap.exr lacks channel 'S0.550,000nm'"):
        IsetExr(str(folder), "1112184733")()
    for bad in (np.nan, -1.0, np.inf):
        broken = {k: v.copy() for k, v in channels.items()}
        broken["S0.610,000nm"][3, 4] = bad
        write(path, broken)
        with pytest.raises(UnitError, match="skymap.exr channel 'S0.610,000nm'"):
            IsetExr(str(folder), "1112184733")()


def test_files_that_do_not_fit_together_are_an_error(deposit):
    folder, light = deposit
    savemat(folder / "1112184733.mat", {"sceneMeta": {"depthMap": np.ones((4, 5))}})
    with pytest.raises(UnitError, match="1112184733.mat holds a distance map of 5 x 4"):
        IsetExr(str(folder), "1112184733")()
    write(
        folder / "1112184733_otherlights.exr",
        {f"S0.{nm},000nm": light["sky"][k, :9] for k, nm in enumerate(BANDS)},
    )
    with pytest.raises(UnitError, match="otherlights.exr has 32 x 9"):
        IsetExr(str(folder), "1112184733")()


def test_a_wrong_folder_or_id_says_what_to_type(deposit, tmp_path):
    folder, _ = deposit
    with pytest.raises(CatalogError, match="did you mean '1112184733'"):
        IsetExr(str(folder), "1112184734")()
    with pytest.raises(CatalogError, match="not a folder.*scene.folder"):
        IsetExr(str(tmp_path / "nowhere"), "1")()


@pytest.mark.parametrize("kept", [0.0, 0.05, 0.5, 0.99])
def test_a_cut_off_mat_file_is_named(deposit, kept):
    folder, _ = deposit
    path = folder / "1112184733.mat"
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(CatalogError, match="1112184733.mat is not a readable MAT file"):
        IsetExr(str(folder), "1112184733")()


def planned(folder):
    """Return the overrides of a run of the scene in `folder`."""
    run = ["~renderer", "~versions", "~flare.dirt", "lens=ideal", "lighting=ideal"]
    scene = ["scene=iset_exr", f"scene.folder={folder}", "scene.scene_id='1112184733'"]
    return [*scene, *run, "sensor=ideal"]


def cells():
    """Return an object array, as a MATLAB cell array is read."""
    found = np.empty(SHAPE, object)
    found[:] = [[np.array([5.0])] * SHAPE[1]] * SHAPE[0]
    return found


@pytest.mark.parametrize(
    ("depth", "said"),
    [
        (cells(), "object values"),
        (np.full(SHAPE, 5 + 1j), "complex128 values"),
        (np.full(SHAPE, np.nan), "no finite value"),
        (np.full(SHAPE, -5.0), "holds -5"),
    ],
)
def test_a_map_without_distances_is_refused(deposit, depth, said):
    folder, _ = deposit
    savemat(folder / "1112184733.mat", {"sceneMeta": {"depthMap": depth}})
    scene = IsetExr(str(folder), "1112184733")
    for call in (scene, scene.check_files, lambda: print_plan(planned(folder))):
        with pytest.raises(UnitError, match=f"depthMap.*{said}.*expected real distances in metres"):
            call()


def test_tiles_without_a_surface_have_no_distance(deposit):
    folder, _ = deposit
    depth = np.full(SHAPE, 5.0)
    depth[0, 0], depth[0, 1] = np.nan, np.inf
    savemat(folder / "1112184733.mat", {"sceneMeta": {"depthMap": depth}})
    np.testing.assert_array_equal(IsetExr(str(folder), "1112184733")().distance, depth)


def test_a_band_in_two_spellings_is_named(deposit):
    folder, light = deposit
    channels = {f"S0.{nm},000nm": light["sky"][k] for k, nm in enumerate(BANDS)}
    write(folder / "1112184733_skymap.exr", {**channels, "S0.550.000nm": light["sky"][0]})
    for call in (IsetExr(str(folder), "1112184733"), lambda: print_plan(planned(folder))):
        with pytest.raises(CatalogError, match="two channels for 550 nm.*expected one per band"):
            call()


def test_a_plan_reads_no_light(deposit, monkeypatch, capsys):
    """Plan a scene from the names of its files; refuse a target for a missing light group."""
    folder, _ = deposit
    (folder / "1112184733_streetlights.exr").unlink()
    monkeypatch.setattr(iset_exr_files, "_channels", lambda path: pytest.fail("light was read"))
    print_plan(planned(folder))
    assert "light groups" in capsys.readouterr().out
    target = "+lighting.targets.streetlights={statistic: max, cd_m2: 1}"
    with pytest.raises(ConfigError, match="no light group 'streetlights'"):
        print_plan([*planned(folder), "lighting=targets", target])


def test_a_link_to_a_file_that_is_gone_is_named_before_work_starts(deposit):
    folder, _ = deposit
    link = folder / "1112184733_streetlights.exr"
    link.unlink()
    link.symlink_to(folder / "gone.exr")
    scene = IsetExr(str(folder), "1112184733")
    for call in (scene, scene.input_files):
        with pytest.raises(
            CatalogError, match="streetlights.exr is not a file, or is a link to a missing file"
        ):
            call()


@pytest.mark.parametrize("scene_id", ["*", "../other", "[", "a/b", "\0"])
def test_an_id_that_is_no_name_is_refused(scene_id):
    with pytest.raises(ConfigError, match="scene_id is .*expected letters, digits"):
        IsetExr(scene_id=scene_id)
