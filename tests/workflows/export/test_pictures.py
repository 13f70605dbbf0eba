"""Exported pictures, radiance and captures: values, units, and the right way up."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import OpenEXR
import pytest
import tifffile
from isethdr_catalog.selection import StoredShot
from isethdr_workflows.export.exporting import exported
from isethdr_workflows.export.job import Job
from isethdr_workflows.export.pictures import radiance
from PIL import Image

from isethdr_core.errors import CatalogError
from isethdr_core.physics.colour.colour_spaces import linear_srgb
from isethdr_core.results.stored import open_run

from .stored_runs import BANDS, SCENE, scene


@pytest.fixture
def run(home):
    """Return the run without labels."""
    return open_run(home.plain)


def test_a_png_is_the_picture_of_the_report(home, run, tmp_path):
    from isethdr_catalog.report.pictures import compression, shown, shown_white_cd_m2

    job = exported(["first"], tmp_path / "out", ["png"], licence="CC0-1.0")
    [path] = (tmp_path / "out" / "png").iterdir()
    assert path.name == f"{run.key}_bayer.png" and len(job.files) == 1
    image = Image.open(path)
    truth = run.open("truth/bayer")
    white = shown_white_cd_m2(truth)
    reported = shown(run.open("picture/bayer"), white, "", compression(truth, white))
    with Image.open(as_file(reported.source)) as same:
        np.testing.assert_array_equal(np.asarray(image), np.asarray(same))
    assert image.info["srgb"] == 0 and f"white {white:.4g} cd/m2" in image.info["Description"]
    assert run.key in image.info["Source"] and image.info["Copyright"] == "CC0-1.0"
    rows = np.asarray(image, float).mean((1, 2))
    assert rows[-1] > rows[0] + 20, "the ramp is brightest in the last row"


def as_file(address: str):
    """Return the bytes of a data address as a file."""
    import base64
    import io

    return io.BytesIO(base64.b64decode(address.partition(",")[2]))


def test_an_exr_holds_the_picture_in_cd_m2(home, run, tmp_path):
    exported([run.key], tmp_path / "out", ["exr"])
    for group, name in (("picture", ""), ("truth", "_reference")):
        with OpenEXR.File(str(tmp_path / f"out/exr/{run.key}_bayer{name}.exr")) as file:
            pixels = np.array(file.channels()["RGB"].pixels)
            header = dict(file.header())
        xyz = run.open(f"{group}/bayer")["xyz"].values
        # 1e-6: the file is float32; the matrix is applied in float64
        np.testing.assert_allclose(pixels, linear_srgb(xyz), rtol=1e-6, atol=1e-4)
        assert header["whiteLuminance"] == 1.0 and "cd/m2" in header["comments"]


def test_radiance_has_one_part_for_each_light_group(home, tmp_path):
    """A run that read the radiance and a query for scenes give the same file."""
    for what, name in (([home.labelled], "a"), (["kind=scene"], "b")):
        exported(what, tmp_path / name, ["radiance"])
    path = tmp_path / "a" / "radiance" / f"{SCENE[:16]}.exr"
    assert path.read_bytes() == (tmp_path / "b" / "radiance" / path.name).read_bytes()
    light = scene()["radiance"].values
    with OpenEXR.File(str(path), separate_channels=True) as file:
        assert [part.name() for part in file.parts] == ["sky", "headlights"]
        for number, values in enumerate(light):
            header = file.header(number)
            channels = file.channels(number)
            assert header["wavelengthsNm"] == "450 555.5 650"
            assert header["emissiveUnits"] == "W.m^-2.sr^-1.nm^-1"
            assert header["fieldWidth"] == pytest.approx(0.4, rel=1e-6)  # float32
            names = [f"S0.{nm:.3f}".replace(".", ",").replace("S0,", "S0.") + "nm" for nm in BANDS]
            assert sorted(channels) == sorted(names) and names[1] == "S0.555,500nm"
            found = np.stack([channels[name].pixels for name in names])
            np.testing.assert_array_equal(found, values)  # stores round no small integers


def test_a_run_without_stored_radiance_is_refused(home, tmp_path):
    with pytest.raises(CatalogError, match=f"run {home.plain} has no stored radiance"):
        exported([home.plain], tmp_path / "out", ["png", "radiance"])
    with pytest.raises(CatalogError, match="finds 1 scenes, and png writes pictures of runs"):
        exported(["kind=scene"], tmp_path / "out", ["radiance", "png"])
    assert not (tmp_path / "out").exists()


def test_a_dng_holds_the_captures_bit_for_bit(home, run, tmp_path):
    exported(["first"], tmp_path / "out", ["dng"])
    captures = run.open("captures/bayer")
    names = list(map(str, captures["capture"].values))
    assert len(names) == len(list((tmp_path / "out" / "dng").iterdir())) > 0
    for number, name in enumerate(names):
        raw = tifffile.imread(tmp_path / f"out/dng/{run.key}_bayer_{name}.dng")
        np.testing.assert_array_equal(raw, captures["raw"].values[number])


def test_a_sequence_is_one_moving_picture_in_the_order_of_time(home, run, tmp_path):
    """The second run shows half of the light a quarter of a second later."""
    job = exported(["two"], tmp_path / "out", ["animation", "png"])
    with Image.open(tmp_path / "out/animation/bayer.png") as moving:
        assert moving.n_frames == 2 and moving.info["duration"] == 250
        frames = []
        for k in range(2):
            moving.seek(k)
            frames.append(np.asarray(moving.convert("RGB")))
        assert moving.info["duration"] == 500
    still = Image.open(tmp_path / "out/png" / f"{run.key}_bayer.png")
    np.testing.assert_array_equal(frames[0], np.asarray(still))
    assert frames[1].mean() < frames[0].mean() - 10  # both have the white of the first
    assert [one.media_type for one in job.files if one.format == "animation"] == ["image/apng"]
    with pytest.raises(CatalogError, match="1 pictures at 1 times; expected one sequence"):
        exported([run.key], tmp_path / "other", ["animation"])


def test_radiance_is_in_the_home_of_its_run(tmp_path):
    shot = StoredShot(tmp_path / "other" / "runs" / "a.zarr", "bayer")
    item = SimpleNamespace(shot=shot, attributes={"scene_ids": ["s"]})
    job = Job([item], (), tmp_path, "title", "", "")
    assert list(radiance._scenes(job)) == [tmp_path / "other" / "scenes" / "s.zarr"]
