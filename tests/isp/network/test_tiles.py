"""Tiles for networks have no seams, and their padding keeps the phase of the filter array."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from isethdr_isp.network.contract import Contract
from isethdr_isp.network.contract_model import ContractModel
from isethdr_isp.network.running import Cut, grid_of
from isethdr_isp.network.tiles import Grid, even_tile, padding, tiled, windows

import isethdr_core as hdr
from isethdr_core.ledger import Ledger, stage
from isethdr_core.onnx_session import open_session

FLOAT32 = 1e-6  # share of the largest value; the order of sums may depend on the size of the tile


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 40), st.integers(0, 7), st.integers(1, 8), st.integers(0, 60))
def test_padding_keeps_the_phase_and_the_pixels(count, phase, period, more):
    phase = phase % period
    pad = padding(count, phase, period, phase + count + more)
    assert len(pad.index) == phase + count + more and pad.before == phase
    assert np.array_equal(pad.index[phase : phase + count], np.arange(count))
    assert pad.index.min() >= 0 and pad.index.max() < count
    if count >= 2 * period:
        assert np.all((pad.index - np.arange(-phase, count + more)) % period == 0)


def test_padding_of_a_2_x_2_array_is_a_mirror_about_the_outermost_pixel():
    pad = padding(10, 1, 2, 16)
    assert pad.index.tolist() == [1, *range(10), 8, 9, 6, 7, 4]
    assert pad.index.tolist()[1:13] == np.pad(np.arange(10), (0, 2), "reflect").tolist()[:11] + [9]


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 300), st.integers(1, 8), st.integers(0, 8))
def test_tiles_cover_every_place_once(size, cells, overlap):
    tile = 2 * overlap + 8 * cells
    parts = windows(size, tile, overlap)
    kept = [place for w in parts for place in range(w.keep_from, w.keep_to)]
    assert kept == list(range(size))
    for w in parts:
        assert w.start <= w.keep_from <= w.keep_to <= w.stop <= size
        assert w.start == 0 or w.keep_from - w.start >= overlap
        assert w.stop == size or w.stop - w.keep_to >= overlap


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 200), st.integers(0, 6), st.integers(1, 12))
def test_free_tiles_are_even_and_not_more(sizes, overlaps, kept):
    multiple = 8
    size = multiple * sizes
    overlap = multiple * overlaps
    largest = 2 * overlap + multiple * kept
    tile = even_tile(size, Grid((2, 2), multiple, overlap, (largest, largest)), 0)
    assert tile <= largest and tile % multiple == 0
    assert len(windows(size, tile, overlap)) == len(windows(size, largest, overlap))


def test_a_tiled_picture_has_no_seams(models, taken, tmp_path):
    # a convolution of 17 x 17 pixels reaches 8 pixels, the overlap of the tiles
    contract = {**models.CONTRACT, "calibration": "unknown", "multiple_px": 8, "reach_px": 8}
    path = models.convolution(tmp_path / "wide.onnx", 17, contract)
    captures, _ = taken((150, 203))
    whole = hdr.build("isp", "network", model=str(path), tile_px=1024)(captures).xyz.values
    parts = hdr.build("isp", "network", model=str(path), tile_px=64)(captures).xyz.values
    assert np.abs(whole - parts).max() <= FLOAT32 * np.abs(whole).max()
    # a stated reach that is too small leaves seams, so the comparison above can fail
    path = models.convolution(tmp_path / "seams.onnx", 17, {**contract, "reach_px": 0})
    seams = hdr.build("isp", "network", model=str(path), tile_px=64)(captures).xyz.values
    assert np.abs(whole - seams).max() > 1e-2 * np.abs(whole).max()


def test_a_reach_that_is_not_stated_is_measured(models, tmp_path):
    contract = {k: v for k, v in models.CONTRACT.items() if k != "reach_px"}
    for side, reach in ((9, 4), (1, 0)):
        path = models.convolution(tmp_path / f"{side}.onnx", side, contract)
        model = ContractModel(open_session(path, "test"), Contract.from_json(json.dumps(contract)))
        assert model.cut.reach_px == reach
    path = models.with_mean(tmp_path / "mean.onnx", contract)
    model = ContractModel(open_session(path, "test"), Contract.from_json(json.dumps(contract)))
    assert model.cut.reach_px == np.inf


def test_a_model_that_looks_at_the_whole_picture_is_not_tiled(models, taken, tmp_path):
    contract = {**models.CONTRACT, "calibration": "unknown", "reach_px": None}
    path = models.with_mean(tmp_path / "mean.onnx", contract)
    captures, _ = taken((150, 204))
    one = hdr.build("isp", "network", model=str(path), tile_px=64)(captures).xyz.values
    assert one.std() == pytest.approx(0, abs=1e-9) and one.mean() > 0


def test_tiles_are_enlarged_where_the_reach_asks_for_it():
    grid = grid_of(Cut((2, 2), 8, 100.0), 64)
    assert grid.overlap == 104 and grid.tile[0] % 8 == 0
    # at least a quarter of each side is kept
    assert grid.tile[0] - 2 * grid.overlap >= grid.tile[0] / 4


@pytest.mark.parametrize(
    "side, multiple, reach, overlap",
    [(64, 32, 20, 0), (96, 32, 35, 32), (64, 32, np.inf, 0), (64, 8, 20, 24)],
)
def test_tiles_of_fixed_size_keep_a_part_of_each_tile(side, multiple, reach, overlap):
    """The overlap is rounded up to the multiple, unless nothing of a tile would remain."""
    rows = Ledger()
    with stage(rows, "isp network"):
        grid = grid_of(Cut((2, 2), multiple, reach, (side, side)), 1024)
    assert grid.overlap == overlap
    raw = np.random.default_rng(0).normal(size=(1, 200, 150)).astype(np.float32)
    assert np.array_equal(tiled(lambda planes: planes, {"raw": raw}, (1, 0), grid)["raw"], raw)
    seams = [note for note in rows[0].left_out if note.key == "seams"]
    assert bool(seams) == (reach > overlap), "seams are possible"


def test_a_model_of_fixed_size_sees_only_that_size():
    sizes = []

    def network(planes):
        sizes.append(planes["raw"].shape)
        return planes

    raw = np.random.default_rng(0).normal(size=(1, 37, 90)).astype(np.float32)
    grid = Grid((2, 2), 2, 4, (32, 48), fixed=True)
    result = tiled(network, {"raw": raw}, (1, 0), grid)
    assert np.array_equal(result["raw"], raw)
    assert set(sizes) == {(1, 1, 32, 48)}
    small = tiled(network, {"raw": raw[:, :9, :11]}, (1, 1), grid)
    assert np.array_equal(small["raw"], raw[:, :9, :11])
    assert set(sizes) == {(1, 1, 32, 48)}
