"""Models in the published layout, with stand-ins of the same inputs and outputs."""

import numpy as np
import pytest
from isethdr_isp.network.published import FILL, TILE_PX

import isethdr_core as hdr
from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.truth import variance_known


def network(path, **fields):
    return hdr.build("isp", "network", model=str(path), **fields)


@pytest.mark.parametrize(("planes", "size"), [(3, 256), (4, None)])
def test_flat_fields_come_back(models, bench, tmp_path, planes, size):
    pattern, qe = (bench.BAYER, bench.QE) if planes == 3 else (bench.RGBW, bench.QE_W)
    grey = bench.mosaic_of(np.full(31, 0.01), (70, 90), pattern, qe)
    captures = bench.make(grey, pattern=pattern, qe=qe)
    path = models.published(tmp_path / "published.onnx", planes, size)
    picture = network(path)(captures)
    classical = hdr.build("isp", "linear")(captures)
    wrong = np.abs(picture.xyz.values / classical.xyz.values - 1)
    # FILL, a thousandth of the brightest channel, is averaged into the weakest channel, with three
    # times the weight of its own samples
    assert np.median(wrong[2:-2, 2:-2]) < 3 * FILL * grey.max() / grey.min()
    assert not variance_known(picture) and np.isnan(picture.variance.values).all()


def test_a_fixed_size_and_a_free_size_agree(models, taken, tmp_path):
    captures, _ = taken((90, 700))
    free = network(models.published(tmp_path / "free.onnx", 3, None))(captures)
    fixed = network(models.published(tmp_path / "fixed.onnx", 3, 128))(captures)
    # 1e-6: rounding of float32, times the few samples of a sum
    limit = 1e-6 * np.abs(free.xyz.values).max()
    assert np.abs(free.xyz.values - fixed.xyz.values)[1:-1, 1:-1].max() < limit


def test_the_ledger_has_what_the_file_does_not_state(models, taken, tmp_path):
    captures, _ = taken()
    rows = ledger.Ledger()
    path = models.published(tmp_path / "published.onnx", 3, None)
    with ledger.stage(rows, "isp network"):
        network(path)(captures)
    stated = {note.key: note.why for note in rows[0].left_out}
    assert {"variance", "unit", "clipped"} <= stated.keys()
    assert "brightest sample is 0.95" in stated["unit"]
    assert "seams" not in stated  # the measured reach is one pixel


def test_tiles_of_a_model_that_looks_at_all_of_them_may_have_seams(models, taken, tmp_path):
    captures, _ = taken((40, TILE_PX + 60))
    rows = ledger.Ledger()
    path = models.published(tmp_path / "global.onnx", 3, None, mean=True)
    with ledger.stage(rows, "isp network"):
        network(path)(captures)
    [note] = [note for note in rows[0].left_out if note.key == "seams"]
    assert "seams are possible" in note.why


def test_planes_that_the_sensor_does_not_have(models, tmp_path):
    isp = network(models.published(tmp_path / "published.onnx", 4, None))
    isp.check_shot(ShotForm(("single",), ("RG", "WB")))
    with pytest.raises(ConfigError, match="takes 4 planes, .* R, G, B, W; the sensor has B, G, R"):
        isp.check_shot(ShotForm(("single",), ("RG", "GB")))
