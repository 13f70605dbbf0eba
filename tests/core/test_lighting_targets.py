"""Weights solved from targets: each target is reached, or stated as not reached."""

from __future__ import annotations

import numpy as np
import pytest

from isethdr_core.config.composition import compose
from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.lighting import TargetsLighting, solver, target
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build_from_config
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger

BANDS = np.arange(400.0, 701.0, 10.0)
SKY = ["sky"]
HEIGHT = 30
WIDTH = 40
# relative tolerance: mixed light is stored as float32, and its luminance sums 31 rounded bands
STORED = 3e-7
# relative tolerance: linear statistics are solved by one division, percentiles by a search to 1e-14
REACHED = 1e-6


def light_from(maps):
    """Return scene radiance in which each group has its luminance map, cd/m2, and own spectrum."""
    cubes = []
    for k, y in enumerate(maps.values()):
        spectrum = np.exp(-(((BANDS - 450 - 60 * k) / 80) ** 2))
        cubes.append((spectrum / luminance(spectrum, BANDS))[:, None, None] * y)
    ds = quantities.scene_radiance(
        np.stack(cubes),
        maps,
        BANDS,
        quantities.centres(WIDTH, 0.8),
        quantities.centres(HEIGHT, 0.6),
    )
    ds.attrs["lamps"] = [
        {"object": 1, "kind": "low_beam", "group": "headlights", "luminance_cd_m2": 2e6},
        {"object": 2, "kind": "tail", "group": "other", "luminance_cd_m2": 500.0},
    ]
    return ds


@pytest.fixture(scope="module")
def night():
    """Return a daylight sky over a dark ground, and two groups of lamps that light the ground."""
    rng = np.random.default_rng(1)
    rows = np.arange(HEIGHT)[:, None]
    sky = np.where(rows < 12, 4000.0, 400.0) * rng.uniform(0.5, 1, (HEIGHT, WIDTH))
    lamps = 5.0 * rng.uniform(0.001, 1, (HEIGHT, WIDTH)) ** 3 * (rows > 12)
    lamps[15, 10:12] = 1e6
    street = 2.0 * rng.uniform(0, 1, (HEIGHT, WIDTH))
    street[3, 30] = 3e5
    return light_from({"sky": sky, "headlights": lamps, "streetlights": street})


def found(mixed):
    return luminance(mixed.values.astype(float), BANDS)


def test_per_group_targets_are_reached(night):
    light = TargetsLighting(
        {
            "headlights": {"statistic": "max", "cd_m2": 3e4},
            "streetlights": {"statistic": "mean", "cd_m2": 2.0},
            "sky": {"statistic": "percentile", "percentile": 30, "cd_m2": 0.5},
        }
    )
    mixed = light(night)
    assert mixed.attrs["infeasible"] == ""
    alone = {
        g: found(TargetsLighting(weights={g: mixed.attrs["weights"][g]}, others=0.0)(night))
        for g in mixed.attrs["weights"]
    }
    assert alone["headlights"].max() == pytest.approx(3e4, rel=REACHED)
    assert alone["streetlights"].mean() == pytest.approx(2.0, rel=REACHED)
    assert np.percentile(alone["sky"], 30, method="hazen") == pytest.approx(0.5, rel=REACHED)


def test_lamp_axis_reads_no_light_and_knows_the_kind(night):
    light = TargetsLighting(
        {"headlights": {"statistic": "lamp_axis", "cd_m2": 5e5}}, weights={"sky": 1e-4}
    )
    assert light(night).attrs["weights"] == {"sky": 1e-4, "headlights": 0.25, "streetlights": 1.0}
    absent = TargetsLighting(
        {"headlights": {"statistic": "lamp_axis", "lamp_kind": "xenon", "cd_m2": 5e5}}
    )(night)
    assert (
        absent.attrs["weights"]["headlights"] == 1.0
        and "headlights: wanted 500000, reached 0" in absent.attrs["infeasible"]
    )
    bare = night.copy()
    del bare.attrs["lamps"]
    with pytest.raises(ConfigError, match="lists no lamps.*statistic=max"):
        light(bare)


@pytest.mark.parametrize("ratio", [1e3, 1e4, 1e6])
def test_dynamic_range_is_reached_by_the_sky_alone(night, ratio):
    mixed = TargetsLighting(moves=SKY, dynamic_range=ratio)(night)
    low, high = np.percentile(found(mixed), [1, 100], method="hazen")
    assert high / low == pytest.approx(ratio, rel=REACHED)
    assert mixed.attrs["weights"]["headlights"] == mixed.attrs["weights"]["streetlights"] == 1.0
    assert mixed.attrs["infeasible"] == ""


@pytest.mark.parametrize(("name", "level"), [("median_cd_m2", 30.0), ("mean_cd_m2", 9000.0)])
def test_level_of_the_picture(night, name, level):
    mixed = TargetsLighting(moves=SKY, **{name: level})(night)
    statistic = np.median if name == "median_cd_m2" else np.mean
    assert statistic(found(mixed)) == pytest.approx(level, rel=REACHED)
    assert mixed.attrs["weights"]["headlights"] == 1.0
    with_range = TargetsLighting(moves=SKY, dynamic_range=1e5, **{name: level})(night)
    y = found(with_range)
    assert statistic(y) == pytest.approx(level, rel=REACHED)
    low, high = np.percentile(y, [1, 100], method="hazen")
    assert high / low == pytest.approx(1e5, rel=REACHED)
    # lamps have no target of their own, so that the weights of all groups may change
    assert with_range.attrs["infeasible"] == ""


def test_the_impossible_is_said_and_bounded(night):
    book = ledger.Ledger()
    with ledger.stage(book, "lighting"):
        mixed = TargetsLighting(moves=SKY, mean_cd_m2=1.0)(
            night
        )  # the lamps alone have a mean of 1900
    assert (
        mixed.attrs["weights"]["sky"] == 0
        and "mean_cd_m2: wanted 1, reached" in mixed.attrs["infeasible"]
    )
    assert book[0].error > 1000 and any("mean_cd_m2" in row.what for row in book[0].left_out)
    too_much = TargetsLighting(moves=SKY, dynamic_range=1e15, low_percentile=90.0)(night)
    assert (
        "dynamic_range" in too_much.attrs["infeasible"] and too_much.attrs["weights"]["sky"] < 1e-6
    )
    too_little = TargetsLighting(moves=SKY, dynamic_range=1.5)(night)
    assert "dynamic_range" in too_little.attrs["infeasible"]
    both = TargetsLighting(
        {"headlights": {"statistic": "max", "cd_m2": 1e5}},
        moves=SKY,
        dynamic_range=1e5,
        median_cd_m2=30.0,
    )(night)
    # scaling all light to the median has also scaled the lamp
    assert "headlights: wanted 100000" in both.attrs["infeasible"]


def test_identical_collinear_dark_and_absent_groups():
    y = np.random.default_rng(2).uniform(1, 100, (HEIGHT, WIDTH))
    twins = light_from({"sky": y, "headlights": y, "streetlights": y * (1 + 1e-13), "other": 0 * y})
    light = TargetsLighting(
        {"headlights": {"statistic": "max", "cd_m2": 50.0}}, moves=SKY, median_cd_m2=500.0
    )
    mixed = light(twins)
    assert np.isfinite(list(mixed.attrs["weights"].values())).all()
    assert np.median(found(mixed)) == pytest.approx(500.0, rel=REACHED)
    # all groups have the same shape, so that weights cannot change the ratio
    assert (
        "dynamic_range" in TargetsLighting(moves=SKY, dynamic_range=1e6)(twins).attrs["infeasible"]
    )
    dark = TargetsLighting({"other": {"statistic": "max", "cd_m2": 10.0}})(twins)
    assert (
        dark.attrs["weights"]["other"] == 1.0
        and "other: wanted 10, reached 0" in dark.attrs["infeasible"]
    )
    for bad, said in (
        ({"targets": {"head": {"cd_m2": 1.0}}}, "no light group 'head'"),
        (
            {"moves": ["moon"], "median_cd_m2": 1.0},
            r"lighting.moves is \['moon'\], and the scene has no such light group",
        ),
    ):
        with pytest.raises(ConfigError, match=said):
            TargetsLighting(**bad)(twins)
    black = TargetsLighting(moves=SKY, dynamic_range=1e6, median_cd_m2=1.0)(
        light_from({"sky": 0 * y, "headlights": 0 * y})
    )
    assert not black.values.any() and "median_cd_m2" in black.attrs["infeasible"]


def test_searches_work_over_thirty_decades():
    rng = np.random.default_rng(3)
    rest = rng.uniform(0, 1e-9, 500)
    ambient = rng.uniform(0.5, 1, 500)
    for wanted in (1e-8, 1.0, 1e12, 1e22):
        w = solver.weight_for_percentile(rest, ambient, 50.0, wanted)
        assert solver.percentile_of(rest + w * ambient, 50.0) == pytest.approx(wanted, rel=1e-12)
    lamps = np.zeros(500)
    lamps[0] = 1.0
    for wanted in (10.0, 1e6, 1e15):
        w = solver.weight_for_dynamic_range(lamps, ambient, wanted, 1.0, 100.0)
        assert solver.dynamic_range(lamps + w * ambient, 1.0, 100.0) == pytest.approx(
            wanted, rel=1e-9
        )


def test_seeded_ranges_are_reproducible_and_do_not_depend_on_other_groups():
    one = target.parse({"headlights": {"statistic": "max", "cd_m2": [2e4, 9e4]}})
    more = target.parse(
        {
            "other": {"statistic": "max", "relative_to": "headlights", "ratio": [4e-4, 1e-2]},
            "headlights": {"statistic": "max", "cd_m2": [2e4, 9e4]},
        }
    )
    draws = [target.draw(one, seed)["headlights"] for seed in range(400)]
    assert draws == [target.draw(more, seed)["headlights"] for seed in range(400)]
    assert min(draws) >= 2e4 and max(draws) <= 9e4
    # a uniform variate: mean 0.5, standard error 0.289 / sqrt(400) = 0.0144; four of them
    assert abs((np.mean(draws) - 2e4) / 7e4 - 0.5) < 0.058
    ratios = [d["other"] / d["headlights"] for d in (target.draw(more, s) for s in range(50))]
    assert 4e-4 <= min(ratios) < max(ratios) <= 1e-2
    assert target.draw(more, 7) == target.draw(more, 7)
    # the draws of two groups are independent: correlation 0, standard error 1 / sqrt(400) = 0.05;
    # four of them
    pairs = [(target.uniform(s, "headlights"), target.uniform(s, "other")) for s in range(400)]
    assert abs(np.corrcoef(np.transpose(pairs))[0, 1]) < 0.2


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"targets": {"sky": {"statistic": "medium", "cd_m2": 1}}}, "statistic is 'medium'"),
        ({"targets": {"sky": {"cdm2": 1}}}, "no key 'cdm2'; did you mean 'cd_m2'"),
        ({"targets": {"sky": {"cd_m2": [3, 1]}}}, "low <= high"),
        ({"targets": {"sky": {"cd_m2": "bright"}}}, "number or a range"),
        ({"targets": {"sky": {"cd_m2": -1}}}, "0 <= low"),
        ({"targets": {"sky": {"statistic": "max"}}}, "needs either"),
        ({"targets": {"other": {"relative_to": "head", "ratio": 0.1}}}, "relative to 'head'"),
        ({"targets": {"sky": {"cd_m2": 1}}, "weights": {"sky": 1.0}}, "both a target and a weight"),
        ({"weights": {"sky": -1.0}}, "with -1.0 in it; expected 0 to"),
        ({"dynamic_range": 0.5}, "expected 1.0001 to"),
        (
            {"dynamic_range": 1e4},
            r"dynamic_range is 10000, and lighting.moves names no light group",
        ),
        ({"median_cd_m2": 2.0}, r"type 'lighting.moves=\[headlights,streetlights,other\]' to keep"),
        ({"mean_cd_m2": 2.0}, r"or 'lighting.moves=\[sky\]' to keep the lamps"),
        ({"median_cd_m2": 0.0}, "expected 1e-09 to"),
        ({"median_cd_m2": 1.0, "mean_cd_m2": 1.0}, "both median_cd_m2 and mean_cd_m2"),
        ({"low_percentile": 99.0, "high_percentile": 1.0}, "low < high"),
    ],
)
def test_impossible_fields_are_config_errors(fields, match):
    with pytest.raises(ConfigError, match=match):
        TargetsLighting(**fields)


def test_narrow_drops_only_what_is_known_to_be_dark():
    light = TargetsLighting({"sky": {"cd_m2": 1.0}}, weights={"streetlights": 0.0})
    assert light.narrow(Demand()).groups is None
    assert light.narrow(Demand(groups=("sky", "streetlights", "other"))).groups == ("sky", "other")
    assert TargetsLighting(weights={"sky": 0.0}, others=0.0, moves=SKY, dynamic_range=10.0).narrow(
        Demand()
    ).groups == ("sky",)


@pytest.mark.parametrize(
    "name",
    [
        "night",
        "night_rural",
        "night_city",
        "dusk",
        "day",
        "tunnel",
        "iset_halogen_night",
        pytest.param("iset_xenon_night", marks=pytest.mark.slow),
        pytest.param("iset_led_night", marks=pytest.mark.slow),
        pytest.param("iset_laser_night", marks=pytest.mark.slow),
        "iset_1112184733_night",
        pytest.param("iset_1112184733_day", marks=pytest.mark.slow),
        pytest.param("iset_1114031438_night", marks=pytest.mark.slow),
        pytest.param("iset_1114091636_night", marks=pytest.mark.slow),
        pytest.param("iset_1114091636_day", marks=pytest.mark.slow),
        pytest.param("iset_1112201236", marks=pytest.mark.slow),
    ],
)
def test_presets_light_a_scene_of_four_groups(night, name):
    y = np.random.default_rng(4).uniform(0.1, 100, (HEIGHT, WIDTH))
    ds = light_from({"sky": 100 * y, "headlights": y, "streetlights": y[::-1], "other": y[:, ::-1]})
    mixed = build_from_config("lighting", compose([f"+lighting={name}"], None).lighting)(ds)
    quantities.check_mixed(mixed)
    assert mixed.attrs.get("infeasible", "") == "" and mixed.values.max() > 0
    if name == "night":
        alone = mixed.attrs["weights"]["sky"] * luminance(
            ds.radiance.sel(light_group="sky").values.astype(float), BANDS
        )
        assert alone.mean() == pytest.approx(0.02, rel=STORED)


@pytest.mark.parametrize(
    ("name", "least_cd_m2", "most_cd_m2"),
    # natural moonless sky: 5e-4 to 2e-3 lx on the ground, divided by pi; zenith of a city
    [("night_rural", 5e-4 / np.pi, 2e-3 / np.pi), ("night_city", 5e-3, 5e-2)],
)
def test_the_sky_of_a_night_is_as_bright_as_skies_are(night, name, least_cd_m2, most_cd_m2):
    """The brightest tile in the light of the sky shows the sky itself."""
    light = build_from_config("lighting", compose([f"+lighting={name}"], None).lighting)
    weight = light(night).attrs["weights"]["sky"]
    sky = luminance(night.radiance.sel(light_group="sky").values.astype(float), BANDS)
    assert least_cd_m2 <= weight * sky.max() <= most_cd_m2


@pytest.mark.parametrize(("name", "sky_cd_m2"), [("night", 0.02), ("dusk", 5.0)])
def test_a_preset_of_another_dynamic_range_keeps_its_sky(night, name, sky_cd_m2):
    """The preset changes the weights of lamps and keeps the sky, for any dynamic range."""
    for wanted in (1e4, 1e6):
        overrides = [f"+lighting={name}", f"lighting.dynamic_range={wanted:g}"]
        mixed = build_from_config("lighting", compose(overrides, None).lighting)(night)
        assert mixed.attrs["infeasible"] == ""
        low, high = np.percentile(found(mixed), [1, 100], method="hazen")
        assert high / low == pytest.approx(wanted, rel=REACHED)
        assert mixed.attrs["targets"]["sky"]["reached"] == pytest.approx(sky_cd_m2, rel=REACHED)
        weights = mixed.attrs["weights"]
        assert weights["headlights"] == weights["streetlights"], "one factor for all that move"


def test_the_sky_moves_where_that_is_asked_for(night):
    overrides = ["+lighting=night", "lighting.dynamic_range=1e5", "lighting.moves=[sky]"]
    with pytest.raises(ConfigError, match="a target of its own.*~lighting.targets.sky"):
        build_from_config("lighting", compose(overrides, None).lighting)
    overrides.append("~lighting.targets.sky")
    mixed = build_from_config("lighting", compose(overrides, None).lighting)(night)
    assert mixed.attrs["weights"]["headlights"] == 1.0 and mixed.attrs["infeasible"] == ""


def test_the_sky_never_moves_unasked(night):
    """Without groups whose weights may change, a target of the picture is refused. Without such a
    target, the scene is lit as built.
    """
    overrides = ["+lighting=targets", "lighting.dynamic_range=1e5"]
    with pytest.raises(ConfigError, match="names no light group that may change to reach it"):
        build_from_config("lighting", compose(overrides, None).lighting)
    plain = build_from_config("lighting", compose(overrides[:1], None).lighting)(night)
    assert set(plain.attrs["weights"].values()) == {1.0}


def test_the_earlier_name_of_the_field_is_accepted(night):
    with pytest.warns(FutureWarning, match=r"lighting.moves=\[sky\]"):
        earlier = TargetsLighting(ambient="sky", dynamic_range=1e4)(night)
    now = TargetsLighting(moves=["sky"], dynamic_range=1e4)(night)
    assert earlier.attrs["weights"] == now.attrs["weights"]


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("ideal", {}),
        ("weights", {"weights": {"sky": 1e-6, "headlights": 2.0}, "others": 0.5}),
        ("weights", {"others": 1.0, "relative_to_mean_cd_m2": 100.0}),
        ("iset", {}),
        (
            "targets",
            {
                "targets": {"other": {"statistic": "mean", "cd_m2": 0.02}},
                "moves": ["sky"],
                "dynamic_range": 1e4,
                "median_cd_m2": 1.0,
            },
        ),
    ],
)
def test_members_keep_the_promises_of_their_kind(name, fields):
    check("lighting", name, **fields)
