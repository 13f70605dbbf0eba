"""Frames of random clutter: windows, rings, and counted decisions that agree with the stated
shares.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.detection.frame import (
    Frame,
    Layout,
    Thing,
    cells,
    level_of,
    noisier,
    owners_of,
    pairs,
)
from isethdr_workflows.detection.imaging import near_lamps
from isethdr_workflows.detection.observer import clutter, counting, difference, observing
from isethdr_workflows.detection.observer.hotelling import detectability
from scipy.special import ndtr

SHAPE = (40, 120)
BOX = (16, 50, 10, 6)


def thing(box=BOX, instance=1) -> Thing:
    return Thing(instance, f"person {instance}", "person", 30.0, 2.0, False, box, 20.0)


def frame(number: int, contrast: float = 3.0, spread: float = 1.0) -> Frame:
    """Return two colours of smooth random clutter with a person in it."""
    random = np.random.default_rng(number)
    coarse = random.normal(0, spread, (2, SHAPE[0] // 4, SHAPE[1] // 4))
    colours = 20 + np.kron(coarse, np.ones((4, 4)))
    owners = np.zeros(SHAPE, np.int32)
    top, left, height, width = BOX
    owners[top : top + height, left : left + width] = 1
    colours[:, owners == 1] += contrast
    return framed(number, colours, owners, (thing(),))


def framed(number: int, colours, owners, things=(), render=None) -> Frame:
    """Return a frame of a road of its own at night."""
    return Frame(
        number=number,
        road=f"road {number}",
        condition="night",
        layout=Layout(owners),
        things=things,
        colours=colours,
        render=render,
    )


def searched(frames, size, order=3, wanted=30) -> clutter.Search:
    """Return the search of the frames, with one more size."""
    search = clutter.searches(frames, order, wanted)["night"]
    return search._replace(sizes=(*search.sizes, size))


def examined(frames, how, bare=None) -> list[observing.Examined]:
    """Return the windows that are read in frames."""
    search = clutter.searches(frames, how.order, how.windows)["night"]
    return [observing.examined(one, search, bare and bare[one.number]) for one in frames]


def observed(frames, how, places, bare=None):
    """Return the rows and decisions of the observer."""
    return observing.observed(examined(frames, how, bare), how, row_of, places)


def row_of(frame, thing, answer):
    return observing.row(frame, thing, answer, observing.Beside("one", 1.0, math.nan))


def test_cells_keep_noise_of_1_and_join_to_noise_of_1():
    """The two greens of a Bayer array count as one colour. 128 x 128 cells give a standard
    deviation to 0.6 %.
    """
    noise = np.random.default_rng(0).normal(size=(256, 256))
    filters = np.array([[0, 1], [1, 2]], np.uint8)
    colours = cells(lambda down, across, channel: noise[down::2, across::2], filters)
    assert colours.shape == (3, 128, 128)
    assert colours.std((1, 2)) == pytest.approx([1, 1, 1], abs=0.02)
    assert pairs(colours).std((1, 2)) == pytest.approx([1, 1, 1], abs=0.04)


def test_a_noisier_frame_has_twice_the_variance_of_the_renderer():
    """Two half buffers have a variance of 2 each on 200 x 200 cells, so the variance of their mean
    is known to 0.7 %. Half their difference, which corrects d'^2, gets twice the variance too.
    """
    random = np.random.default_rng(4)
    halves = random.normal(0, np.sqrt(2), (2, 1, 200, 200))
    owners = np.zeros((200, 200), np.int32)
    render = (halves[0] - halves[1]) / 2
    one = framed(0, halves.mean(0), owners, (), render)
    worse = noisier(one)
    assert one.colours.var() == pytest.approx(1, rel=0.03)
    assert worse.colours.var() == pytest.approx(2, rel=0.03)
    assert worse.render.var() == pytest.approx(2, rel=0.03)
    assert worse.joined(1).var() == pytest.approx(2, rel=0.06)  # not the sums of the frame before
    still = framed(0, halves.mean(0), owners)
    assert noisier(still) is still


@pytest.mark.parametrize("with_bare", [False, True])
def test_an_object_in_the_last_odd_row_has_no_window(with_bare):
    """Cells are joined because the object is 40 cells wide. This leaves out the last of 65 rows."""
    owners = np.zeros((65, 96), np.int32)
    owners[64, 10:50] = 1
    one = thing((64, 10, 1, 40))
    shown = framed(0, np.zeros((1, 65, 96)), owners, (one,))
    search = clutter.searches([shown], 1, 4)["night"]
    size = clutter.size_of(one.box)
    assert size.level == 1
    bare = shown if with_bare else None
    assert difference.seen(shown, one, size, search.shape(size), bare) is None


def test_a_lamp_beside_the_middle_of_a_wide_object_is_near():
    """The object spans 40 degrees. The mean of the unit vectors to its cells has a length of 0.98.
    Without a division by it, a lamp in the middle would seem to be 11 degrees away.
    """
    x = np.tan(np.radians(np.linspace(-30, 30, 121)))
    y = np.tan(np.radians(np.linspace(-5, 5, 21)))
    instance = np.zeros((21, 121), np.uint32)
    instance[8:13, 20:101] = 1
    luminance = np.ones(instance.shape)
    near = []
    for column in (62, 70):  # 1 and 5 degrees beside the middle
        labels = instance.copy()
        labels[10, column] = 2
        bright = luminance.copy()
        bright[10, column] = 1e5
        rows = [{"instance": 1, "name": "car 1", "category": "car"}]
        scene = xr.Dataset(
            {"instance": (("y", "x"), labels)},
            coords={"y": y, "x": x},
            attrs={"objects": rows, "lamps": [{"instance": 2}]},
        )
        near.append(near_lamps(scene, bright))
    assert near == [frozenset({1}), frozenset()]


def test_a_lamp_of_an_equidistant_scene_is_near_by_its_angle():
    """The coordinates are radians. Tangents of the same values would be 2.3 degrees apart."""
    x = np.radians(np.arange(55.0, 71.0))
    instance = np.zeros((3, 16), np.uint32)
    instance[1, 5] = 1  # 60 degrees
    instance[1, 10] = 2  # 65 degrees
    luminance = np.where(instance == 2, 1e5, 1.0)
    scene = xr.Dataset(
        {"instance": (("y", "x"), instance)},
        coords={"y": np.radians([-1.0, 0.0, 1.0]), "x": x},
        attrs={
            "objects": [{"instance": 1, "name": "car 1", "category": "car"}],
            "lamps": [{"instance": 2}],
        },
    )
    tangents = near_lamps(scene, luminance)
    scene.attrs["projection"] = "equidistant"
    assert (tangents, near_lamps(scene, luminance)) == (frozenset({1}), frozenset())


def test_a_bicycle_belongs_to_its_rider_and_trees_to_nobody():
    objects = [
        {"instance": 1, "name": "bicycle 3", "category": "bicycle"},
        {"instance": 2, "name": "rider of bicycle 3", "category": "person"},
        {"instance": 3, "name": "tree 1", "category": "tree"},
        {"instance": 4, "name": "bicycle 4", "category": "bicycle"},
    ]
    assert owners_of(np.array([[0, 1, 2, 3, 4]]), objects).tolist() == [[0, 2, 2, 0, 4]]


def test_large_boxes_are_read_in_joined_cells():
    assert [level_of((0, 0, h, 3)) for h in (3, 24, 25, 48, 96)] == [0, 0, 1, 1, 2]
    size = clutter.size_of((10, 0, 96, 40))
    assert size.level == 2 and size.height == pytest.approx(24, rel=0.1)


def test_the_ring_fills_an_even_surround_exactly_and_leaves_all_else():
    one = frame(1, spread=0.0)
    own = one.layout.mask(0, 1)
    filled = difference.filled(one.colours, difference.ring_of(own, own))
    assert filled[:, own] == pytest.approx(20.0)
    assert np.array_equal(filled[:, ~own], one.colours[:, ~own])
    everyone = np.ones(SHAPE, bool)
    assert difference.ring_of(own, everyone) is None


def test_without_the_object_in_place_the_ring_and_a_bare_view_agree_on_an_even_road():
    one = frame(1, spread=0.0)
    bare = frame(1, contrast=0.0, spread=0.0)
    size = clutter.size_of(BOX)
    shape = clutter.shape_of(size, SHAPE[0], 3)
    from_ring = difference.seen(one, thing(), size, shape, None)
    from_bare = difference.seen(one, thing(), size, shape, bare)
    assert from_ring.difference == pytest.approx(from_bare.difference, abs=1e-9)
    assert np.linalg.norm(from_bare.difference) > 1


def windows(picture, at, shape):
    """Return windows (window, colour, y, x) that are cut out of a picture one by one."""
    height, width = shape.channels.shape
    cut = [picture[:, y : y + height, x : x + width] for y, x in zip(*at, strict=True)]
    return np.stack(cut)


def test_windows_hold_no_road_user_and_are_the_same_for_all_cameras():
    one = frame(3)
    size = clutter.size_of(BOX)
    search = searched([one], size)
    at = clutter.places(one, size, search)
    assert len(at.top) == 30
    owners = one.layout.owners
    marked = framed(3, (owners > 0)[None] * 1.0, owners)
    same = clutter.places(marked, size, search)  # another camera has the same places
    assert np.array_equal(at, same)
    shape = search.shape(size)
    top, left, height, width = shape.box
    held = windows(marked.colours, at, shape)[:, 0, top : top + height, left : left + width]
    assert not held.any()
    full = framed(3, one.colours, np.ones(SHAPE, np.int32))
    assert len(clutter.places(full, size, search).top) == 0


def test_all_light_levels_share_the_places_and_outlines_of_a_scene():
    one = frame(3)
    search = searched([one], clutter.size_of(BOX))
    first = clutter.places(one, clutter.size_of(BOX), search)
    observing.examined(one, search)
    brighter = replace(one, colours=2 * one.colours, _joined={})
    outlines = dict(one.layout.outlines)
    observing.examined(brighter, search)
    assert clutter.places(brighter, clutter.size_of(BOX), search) is first
    assert len(outlines) == 1
    assert all(brighter.layout.outlines[key] is value for key, value in outlines.items())


@pytest.mark.parametrize("box", [BOX, (0, 40, 6, 4), (33, 90, 7, 8), (2, 30, 36, 26)])
def test_rows_that_are_not_read_have_no_influence(box):
    """The rows are NaN, which any sum would show. The boxes lie in the middle, at both borders,
    and across joined cells.
    """
    one = frame(5)
    owners = np.zeros(SHAPE, np.int32)
    owners[box[0] : box[0] + box[2], box[1] : box[1] + box[3]] = 1
    render = np.random.default_rng(1).normal(size=one.colours.shape)
    whole = framed(5, one.colours, owners, (thing(box),), render)
    search = clutter.searches([whole], 2, 12)["night"]
    rows = observing.rows_read(whole, search)
    outside = np.ones(SHAPE[0], bool)
    outside[rows] = False
    cut = replace(whole, colours=whole.colours.copy(), rows=rows, render=render.copy(), _joined={})
    cut.colours[:, outside] = np.nan
    cut.render[:, outside] = np.nan
    assert outside.any() or box[2] > 24
    for expected, got in ((whole, cut), (noisier(whole), noisier(cut))):
        before = observing.examined(expected, search)
        after = observing.examined(got, search)
        for size, moments in before.moments.items():
            assert moments.count == after.moments[size].count
            assert np.array_equal(moments.squares, after.moments[size].squares)
        assert np.array_equal(before.windows[0].outputs, after.windows[0].outputs)
        assert np.array_equal(before.windows[0].difference, after.windows[0].difference)
        assert np.array_equal(before.windows[0].render, after.windows[0].render)


def test_without_objects_no_cell_is_read():
    one = replace(frame(3), things=())
    search = clutter.searches([one], 3, 30)["night"]
    rows = observing.rows_read(one, search)
    assert rows == slice(0, 0)
    nothing = replace(one, rows=rows, render=lambda rows, columns: 1 / 0)
    assert observing.examined(noisier(nothing), search).moments == {}


def test_outputs_read_in_strips_are_those_of_windows_cut_out_one_by_one():
    one = frame(3)
    size = clutter.size_of(BOX)
    search = searched([one], size)
    shape = search.shape(size)
    at = clutter.places(one, size, search)
    assert len(np.unique(at.top)) > 1
    each = shape.channels.of(windows(one.colours, at, shape))
    # 1e-10: rounding of float64, because the sums run in another order
    assert clutter.outputs_at(one.colours, at, shape.channels) == pytest.approx(each, rel=1e-10)


def test_clutter_is_that_of_other_roads():
    frames = [frame(k) for k in range(4)]
    size = clutter.size_of(BOX)
    read = examined(frames, observing.Observer(order=1, windows=12))
    made = clutter.Clutter([(one.road, one.moments) for one in read])
    moments = made.others(size, "road 2")
    kept = np.concatenate([read[k].empty[size] for k in (0, 1, 3)])
    assert moments.count == len(kept)
    assert clutter.covariance(moments) == pytest.approx(np.cov(kept.T))


def test_counted_hits_and_false_alarms_are_those_stated():
    """The clutter is normal with known covariance. At 5 % of false alarms, 4000 decisions of each
    kind agree with d' within 4 standard deviations of a binomial number. The share of pairs that
    are told apart is Phi(d' / sqrt(2)) (Green and Swets 1966), with a standard deviation of at most
    1 / sqrt(4 * 4000).
    """
    random = np.random.default_rng(11)
    size = 8
    factor = random.normal(size=(size, size)) / 2
    spread = factor @ factor.T
    noise = np.eye(size)
    change = random.normal(size=size)
    task = counting.Task(change, spread, np.full(size, 5.0), noise)
    empty = 5.0 + random.normal(size=(8000, size)) @ factor.T
    done = counting.counted(task, empty[4000:] + change, empty[:4000], 0.05, random)
    d = detectability(change, spread, noise, 10**9).d
    stated = float(counting.expected_share(np.array(d), 0.05))
    assert 0.1 < stated < 0.95
    for count, share in ((done.hits, stated), (done.false_alarms, 0.05)):
        assert abs(count - 4000 * share) < 4 * math.sqrt(4000 * share * (1 - share))
    assert abs(done.told_apart - ndtr(d / math.sqrt(2))) < 4 / math.sqrt(4 * 4000)
    nothing = counting.counted(task, empty[:3], empty[:0], 0.05, random)
    assert math.isnan(nothing.told_apart) and nothing.places == 0


def test_on_drawn_roads_counting_agrees_with_the_observer():
    """60 roads of one kind. Each object has one background, so the number of hits is binomial with
    60 objects: it agrees within 3 standard deviations of at most 0.065.
    """
    frames = [frame(k, contrast=1.2) for k in range(60)]
    how = observing.Observer(order=2, windows=24)
    rows, check = observed(frames, how, observing.places_of(frames))
    assert len(rows) == check.objects == 60
    assert all(row.d <= row.noise_only for row in rows)
    stated = check.expected / check.trials
    assert 0.1 < stated < 0.95
    assert abs(check.hits / check.trials - stated) < 3 * 0.065
    apart = np.array([row.told_apart for row in rows])
    # 3 standard deviations of at most 0.065, as with hits: a share from 0 to 1 spreads less than a
    # hit or a miss
    assert abs(apart.mean() - ndtr(np.array([row.d for row in rows]) / 2**0.5).mean()) < 3 * 0.065
    # 0.05 +- 0.03: 60 roads x 24 windows; windows of one road are correlated
    assert check.false_alarms / check.places == pytest.approx(0.05, abs=0.03)


def test_with_two_roads_and_few_windows_nothing_is_claimed():
    frames = [frame(0), frame(1)]
    rows, check = observed(frames, observing.Observer(windows=8), {"person": 1000.0})
    assert check.objects == 0 and all(math.isnan(row.found) for row in rows)


def test_a_bare_view_takes_the_place_of_the_ring():
    frames = [frame(k, contrast=0.8) for k in range(20)]
    bare = {k: frame(k, contrast=0.0) for k in range(20)}
    how = observing.Observer(order=1, windows=24)
    places = observing.places_of(frames)
    honest, _ = observed(frames, how, places, bare)
    cheap, _ = observed(frames, how, places)
    # with a bare view, the change is known and equal on all roads; the ring only estimates it
    assert np.std([row.noise_only for row in honest]) < 1e-6
    assert np.std([row.noise_only for row in cheap]) > 0.1
