"""Learned demosaic: exact flat fields, a mean without bias, every orientation of an array, and a
file that states how it was made.
"""

import numpy as np
import pytest
from isethdr_isp import LinearIsp
from isethdr_isp.demosaic.learned import (
    TABLE,
    cell_of,
    channels_of,
    exact,
    learned,
    load,
    provenance,
    sampled,
)
from isethdr_isp.demosaic.local_classes import COUNT, classes

from isethdr_core.errors import ConfigError, UnitError

SIDE = 56
INNER = np.s_[..., 4:-4, 4:-4]  # leaves out the border, where samples are repeated


def filters_of(cell, side=SIDE, shift=(0, 0)):
    tile = np.roll(np.vectorize(channels_of(cell).index)(cell_of(cell)), shift, (0, 1))
    return np.tile(tile, (side // len(tile) + 1, side // len(tile[0]) + 1))[:side, :side]


@pytest.mark.parametrize("cell", load())
def test_a_flat_field_of_any_colour_comes_back_exactly_in_every_class(cell):
    colour = np.array([3.0, 40.0, -7.0, 500.0])[: len(channels_of(cell))]
    table = load()[cell]
    assert table.shape[2] == COUNT
    # each filter applied to the field, up to rounding
    np.testing.assert_allclose(
        np.einsum("yxkct,yxst,s->yxkc", table, sampled(cell), colour),
        np.broadcast_to(colour, table.shape[:4]),
        rtol=1e-9,
        atol=1e-9,
    )


def test_sums_are_restored_whatever_rounding_did():
    rng = np.random.default_rng(0)
    for cell in load():
        broken = rng.standard_normal(load()[cell].shape)
        sums = np.einsum("yxkct,yxst->yxkcs", exact(broken, cell), sampled(cell))
        np.testing.assert_allclose(
            sums, np.broadcast_to(np.eye(sums.shape[-1]), sums.shape), atol=1e-12
        )


@pytest.mark.parametrize("cell", load())
@pytest.mark.parametrize("level", [2.0, pytest.param(300.0, marks=pytest.mark.slow)])
def test_the_mean_is_that_of_the_field_and_the_noise_below_that_of_a_sample(cell, level):
    rng = np.random.default_rng(3)
    channels = channels_of(cell)
    filters = filters_of(cell)
    colour = level * np.array([0.6, 1.0, 0.5, 2.0])[: len(channels)]
    mean = colour[filters]
    read = 2.0
    planes = []
    for _ in range(40):
        mosaic = rng.poisson(mean) + read * rng.standard_normal(mean.shape)
        samples = np.maximum(mosaic + read**2, 0.1 * read**2)
        planes.append(learned(mosaic, filters, channels, samples)[INNER])
    true = np.var(planes, 0).mean((1, 2))
    # 40 realisations of 48 x 48 pixels, of which about 25 at a time are correlated: the standard
    # error of the mean is sd / 60
    assert np.all(np.abs(np.mean(planes, (0, 2, 3)) - colour) < 4 * np.sqrt(true) / 60)
    # filters average samples, so no plane is noisier than the noisiest sample; 10 %: 4 standard
    # errors of 2.3 %
    assert np.all(true < (colour.max() + read**2) * 1.1)


def test_every_order_of_an_array_is_the_same_rule():
    rng = np.random.default_rng(1)
    cell = "WGWR/GWRW/WBWG/BWGW"
    mosaic = rng.uniform(50, 100, (SIDE, SIDE))
    whole = learned(mosaic, filters_of(cell), list("RGBW"), mosaic)
    part = learned(mosaic[1:, 2:], filters_of(cell)[1:, 2:], list("RGBW"), mosaic[1:, 2:])
    np.testing.assert_allclose(part[..., 6:-6, 6:-6], whole[:, 1:, 2:][..., 6:-6, 6:-6], rtol=1e-12)
    swapped = learned(mosaic, 3 - filters_of(cell), list("WBGR"), mosaic)
    np.testing.assert_array_equal(swapped[::-1], whole)


@pytest.mark.parametrize("cell", load())
def test_beside_a_lamp_no_value_leaves_the_range_of_the_samples(cell):
    """A step of 1:10 000 is beyond all training. Without the limit to the range of the samples, the
    dark side would fall far below 0.
    """
    channels = channels_of(cell)
    step = np.where(np.arange(SIDE) < 30, 1e5, 10.0) * np.ones((SIDE, 1))
    colour = np.array([1.0, 0.6, 0.2, 1.8])[: len(channels), None, None]
    filters = filters_of(cell)
    mosaic = np.take_along_axis(colour * step, filters[None], 0)[0]
    planes = learned(mosaic, filters, channels, mosaic) / colour
    # 1e-9: rounding of sums of 1e5
    assert planes.min() > 10 * (1 - 1e-9) and planes.max() < 1e5 * (1 + 1e-9)


def test_classes_tell_flat_from_stripes_and_their_direction():
    rng = np.random.default_rng(2)
    stripes = np.broadcast_to(1000 + 600 * np.sin(2.2 * np.arange(SIDE)), (SIDE, SIDE))
    for cell in load():
        filters = filters_of(cell)
        seen = [
            classes(rng.poisson(mean).astype(float), filters, mean)[8:-8, 8:-8] % 6
            for mean in (np.full((SIDE, SIDE), 1000.0), stripes, stripes.T)
        ]
        assert [np.mean(s == kind) > 0.95 for s, kind in zip(seen, (0, 5, 1))] == [True] * 3
    dark = classes(
        rng.poisson(np.full((SIDE, SIDE), 2.0)) + 2 * rng.standard_normal((SIDE, SIDE)),
        filters,
        np.full((SIDE, SIDE), 6.0),
    )
    assert np.mean(dark < 6) > 0.99  # signals below 2.5 sigma have the lowest level class


def test_the_shipped_file_is_small_and_says_how_it_was_made():
    from isethdr_workflows.isp.train_demosaic import ARRAYS, RECIPE, recipe_hash

    said = provenance()
    assert TABLE.stat().st_size < 300_000 and tuple(load()) == ARRAYS
    # if this fails, train again: isethdr study train_demosaic
    assert said["recipe"] == RECIPE and said["sha256"] == recipe_hash(RECIPE)


@pytest.mark.slow
def test_training_beats_the_bilinear_rule_on_pictures_it_never_saw(tmp_path):
    from isethdr_workflows.isp.train_demosaic import train_demosaic

    [row] = train_demosaic(str(tmp_path / "filters.npz"), pictures=2, arrays="RG/GB")
    assert row["learned_error"] < 0.8 * row["bilinear_error"]  # with two pictures; 0.61 with all


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"pictures": 2}, "would replace all filters of the installed isp"),
        ({"arrays": "RG/GB"}, "would replace all filters of the installed isp"),
        ({"path": "filters"}, "ends in .npz"),
        ({"path": "/nowhere/filters.npz"}, "in a folder that exists"),
        ({"path": "filters.npz", "pictures": 0}, "pictures is 0"),
        ({"path": "filters.npz", "arrays": "RG/GB,RG/G"}, "'RG/G'; expected rows of equal length"),
        ({"path": "filters.npz", "arrays": "RG/GB,XY/YX"}, "with the letters R, G, B, W"),
    ],
)
def test_a_training_that_would_lose_filters_is_refused_before_its_work(settings, match):
    from isethdr_workflows.isp.train_demosaic import train_demosaic

    with pytest.raises(ConfigError, match=match):
        train_demosaic(**settings)


def test_what_was_not_learned_is_said(bench):
    mono = bench.make(np.full((24, 32), 50.0), pattern=np.array([[0, 0, 1], [1, 2, 2]]))
    with pytest.raises(
        UnitError, match="no learned filters for this filter array.*RG/GB.*isp.demosaic=guided"
    ):
        LinearIsp(demosaic="learned")(mono)
    with pytest.raises(UnitError, match="smaller than the learned filters"):
        LinearIsp(demosaic="learned")(bench.make(np.full((4, 32), 50.0)))
