"""Launches of any list of tiles: every path is traced once, and the light of a tile does not depend
on the list.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.paths.work_items import MOST_LANES, divide_launches, even_work, listed_work
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.physics.photometry import xyz_weights

from .test_integrator import follower


def test_every_path_of_a_list_is_one_item_s_and_items_of_a_tile_stand_in_one_vector():
    rng = np.random.default_rng(2)
    tiles = rng.permutation(1000)[:300]
    paths = rng.choice([2, 3, 8, 63, 64, 130, 517, 4096], 300)
    work = listed_work(tiles, paths, rng.integers(1, 16, 300))
    assert sorted(work.tiles) == sorted(tiles)
    asked = dict(zip(tiles, paths))
    found = np.bincount(work.owner, work.paths)
    assert {t: int(n) for t, n in zip(work.tiles, found)} == asked and work.paths.min() > 0
    first = np.flatnonzero(work.lane == 0)
    assert (first % work.lanes[first] == 0).all(), "aligned to their own number, at most 16"
    assert work.lanes.min() >= 2 and work.lanes.max() == MOST_LANES
    longest = np.maximum.reduceat(work.paths, first)
    assert (longest - np.minimum.reduceat(work.paths, first)).max() <= 1


def test_a_light_group_does_not_use_the_random_numbers_of_another_purpose():
    from isethdr_mitsuba.paths.tracing.lanes import purpose_of

    names = ["sky", "headlights", "path", "points", "places in fog", "fog sky"]
    purposes = [purpose_of(name) for name in names]
    assert len({*purposes}) == len(names) and not {*purposes} & {*names[2:]}
    assert purposes[:2] == names[:2]  # the numbers of other groups stay as they were


def test_paths_share_camera_rays_only_where_no_lamp_is_requested():
    sky = 0b001
    work = listed_work(np.arange(4), [64, 512, 512, 512], [sky, sky, 0b010, 0b011], sky=sky)
    shares = dict(zip(work.tiles, work.shares[np.flatnonzero(work.lane == 0)]))
    assert shares == {0: 1, 1: 4, 2: 1, 3: 1}


def test_a_pass_is_the_list_of_all_tiles():
    work = even_work(35, 300, 5)
    assert (np.bincount(work.owner, work.paths) == 300).all() and set(work.groups) == {5}


def test_a_tile_is_the_same_in_any_list(make):
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))
    scene = make.street(6)
    settings = MitsubaRenderer(width=12, height=7, step_nm=100.0)
    follow = follower(scene, settings, scene.light_groups())
    every = follow.all_groups()
    whole = follow.even_pass(9, 64)
    tiles = np.array([30, 31, 5, 60, 2])
    alike = follow.launch(9, listed_work(tiles, [64] * 5, [every] * 5))
    assert np.array_equal(alike.radiance, whole[:, :, tiles]) and alike.radiance.any()
    # more paths and fewer groups in other tiles change nothing in these tiles
    bits = [every, 0b0110, every, 0b1001, every]
    work = listed_work(tiles, [64, 200, 64, 8, 1000], bits)
    mixed = follow.launch(9, work)
    for entry, tile in enumerate(work.tiles):
        if tile in (30, 5):
            assert np.array_equal(mixed.radiance[:, :, entry], whole[:, :, tile])
        wanted = bits[list(tiles).index(tile)]
        left_out = [g for g in range(4) if not wanted >> g & 1]
        assert not mixed.radiance[left_out, :, entry].any()
    # batches hold X, Y and Z of the tiles
    xyz = np.einsum("kb,gbt->gkt", xyz_weights(settings.bands_nm()), mixed.radiance)
    sums = [[np.bincount(work.owner, one) for one in group] for group in mixed.batches]
    np.testing.assert_allclose(sums, xyz, rtol=1e-4, atol=1e-6 * xyz.max())
    # another stream has different random numbers
    other = follow.launch(9, listed_work(tiles, [64] * 5, [every] * 5, stream=1))
    assert not np.array_equal(other.radiance[1], alike.radiance[1])
    # the next launch is recorded while another one runs; processors may take any number of items at
    # a time
    assert divide_launches(MOST_LANES)
    running = follow.record(9, work)
    running.start()
    following = follow.record(9, listed_work(tiles, [64] * 5, [every] * 5, stream=1))
    running.wait()
    following.start()
    assert divide_launches()
    assert all(map(np.array_equal, running.found(), mixed))
    following.wait()
    assert all(map(np.array_equal, following.found(), other))
