"""The scalar variant, without a compiler: lamps as spots against their formula, and pictures
against those of compiled variants.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.lamps.placed_lamps import beam, placed_lamps
from isethdr_mitsuba.lamps.spots import spots
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.view import check_square, nearest_square

from isethdr_core import compose
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance
from isethdr_core.pipeline.chain import chain
from isethdr_core.uncertainty import ledger


def one_lamp(make, mesh, **fields):
    values = {
        "intensity_cd": 800.0,
        "axis": (1.0, 0, 0),
        "inner_deg": 10.0,
        "outer_deg": 30.0,
        "lambertian_share": 0.05,
        **fields,
    }
    lamp = make.lamp(
        "drl",
        "headlights",
        values["intensity_cd"],
        make.flat(1.0),
        *(values[k] for k in ("axis", "inner_deg", "outer_deg", "lambertian_share")),
    )
    return make.describe([("lamp", "car", (make.part(mesh, "black", lamp),), make.pose())])


def towards(angle_deg):
    a = np.radians(angle_deg)
    return np.stack([np.cos(a), np.sin(a) * 0.8, np.sin(a) * 0.6], -1)


@pytest.mark.parametrize(("inner", "outer"), [(0.9, 1.6), (10.0, 30.0), (55.0, 80.0), (90.0, 90.0)])
def test_spots_have_the_candela_of_the_lamp(make, inner, outer):
    """Compare spots with the formula of a flat lamp, I cos (beam + floor) / (1 + floor), at angles
    from its axis.
    """
    (placed,) = lamps = placed_lamps(
        one_lamp(make, make.quad(0.4, 0.25), inner_deg=inner, outer_deg=outer)
    )
    angle = np.r_[
        0.0,
        inner * np.array([0.5, 0.9]),
        inner + (outer - inner) * np.array([0.2, 0.5, 0.8]),
        60.0,
        85.0,
        95.0,
    ]
    found = sum(s.candela(towards(angle)) for s in spots(lamps))
    cosine = np.cos(np.radians(angle))
    wanted = (
        800.0
        * (beam(cosine, placed.cos_inner, placed.cos_outer) + placed.floor)
        / (1 + placed.floor)
        * np.maximum(cosine, 0)
    )
    # 6 %: a spot uses the nearest of 128 texels across; where the beam is steepest, it falls by up
    # to 1.5 / 14 from one texel to the next
    np.testing.assert_allclose(found, wanted, rtol=0.02, atol=0.06 * 800 if outer < 90 else 1e-9)
    # compare the flux, which texels do not change: solid angle x candela on rings
    rings = (np.arange(20000) + 0.5) / 20000 * 90
    ring = 2 * np.pi * np.sin(np.radians(rings)) * np.radians(90 / 20000)
    flux = sum(s.candela(towards(rings)) for s in spots(lamps)) @ ring
    c = np.cos(np.radians(rings))
    truth = (
        800.0
        * (beam(c, placed.cos_inner, placed.cos_outer) + placed.floor)
        / (1 + placed.floor)
        * c
        @ ring
    )
    # 1.2 %: a single azimuth over square texels, 1 %; 0.12 % of a Lambertian lamp's light is beyond
    # the widest spot
    assert flux == pytest.approx(truth, rel=0.012)


def test_spots_of_a_curved_lamp_add_up_to_its_faces(make):
    """Compare spots of two rectangles tilted by 20 degrees with the sum of their visible faces."""
    v = np.array(
        [
            [0, 0, 0],
            [-0.1 * np.sin(0.35), 0.1 * np.cos(0.35), 0],
            [-0.1 * np.sin(0.35), 0.1 * np.cos(0.35), 0.1],
            [0, 0, 0.1],
            [-0.1 * np.sin(0.35), -0.1 * np.cos(0.35), 0],
            [-0.1 * np.sin(0.35), -0.1 * np.cos(0.35), 0.1],
        ]
    )
    f = np.array([[0, 1, 2], [0, 2, 3], [0, 5, 4], [0, 3, 5]])
    lamps = placed_lamps(
        one_lamp(make, (v, f), inner_deg=60.0, outer_deg=85.0, lambertian_share=0.0)
    )
    angle = np.array([0.0, 20.0, 40.0, 58.0])
    area = (
        np.cross(
            lamps[0].triangles[:, 1] - lamps[0].triangles[:, 0],
            lamps[0].triangles[:, 2] - lamps[0].triangles[:, 0],
        )
        / 2
    )
    wanted = lamps[0].peak_cd_m2 * np.maximum(towards(angle) @ area.T, 0).sum(1)
    # 5 %: texels are 0.18 wide in tangents, 6 degrees at 40 degrees; the intensity falls by 9 %
    # over a texel, and the nearest texel errs by half of that
    np.testing.assert_allclose(
        sum(s.candela(towards(angle)) for s in spots(lamps)), wanted, rtol=0.05
    )


@pytest.mark.parametrize("angle_deg", [pytest.param(15.0, marks=pytest.mark.slow), 60.0])
def test_a_wall_is_lit_by_the_candela(make, angle_deg):
    """Compare the rendered luminance of a wall 20 m away with that of the compiled variant.

    The inverse square law of the compiled variant has its own test.
    """
    lamp = make.lamp("drl", "headlights", 500.0, make.flat(1.0), (1, 0, 0), 10.0, 30.0, 0.02)
    # the lamp is turned; the wall and the camera are not
    scene = make.describe(
        [
            (
                "lamp",
                "car",
                (make.part(make.quad(0.05, 0.05), "black", lamp),),
                make.pose(-20.0, turn_deg=angle_deg),
            ),
            (
                "wall",
                "chart",
                (make.part((make.quad(1.0, 1.0)[0], make.quad(1.0, 1.0)[1][:, ::-1])),),
                make.pose(),
            ),
        ],
        camera=make.camera((-1.0, 0.0, 0.3), (0, 0, 0), 1.0, 1.0),
    )
    settings = {
        "width": 4,
        "height": 4,
        "margin": 0.0,
        "samples": 256,
        "max_depth": 2,
        "step_nm": 100.0,
    }
    slow = luminance(
        MitsubaRenderer(**settings, variant="scalar")(scene).radiance.values[0],
        np.arange(400.0, 701, 100),
    ).mean()
    fast = luminance(
        MitsubaRenderer(**settings)(scene).radiance.values[0], np.arange(400.0, 701, 100)
    ).mean()
    # 2 %: beam and floor are two spots, and each path samples one of them, so 4096 paths determine
    # their sum to 0.5 %; texels err by 0.5 %
    assert fast > 0 and slow == pytest.approx(fast, rel=0.02)


@pytest.mark.slow
def test_a_mirror_shows_the_lamp_itself(make):
    """No spot can be seen in a mirror; the lamp's own faces can."""
    lamp = make.lamp("drl", "headlights", 500.0, make.flat(1.0), (1, 0, 0), 40.0, 60.0, 0.02)
    wall = make.quad(3.0, 3.0)[0], make.quad(3.0, 3.0)[1][:, ::-1]
    # the camera looks along +x at a mirror that faces it; the lamp is behind the camera and shines
    # towards the mirror
    scene = make.describe(
        [
            ("mirror", "chart", (make.part(wall, "mirror"),), make.pose(4.0)),
            ("lamp", "car", (make.part(make.quad(0.5, 0.5), "black", lamp),), make.pose(-2.0)),
        ],
        camera=make.camera((0, 0, 0), (1, 0, 0), 10.0, 1.0),
        materials=[make.material("mirror", "conductor", make.flat(0.8), 0.0)],
    )
    settings = {
        "width": 8,
        "height": 8,
        "margin": 0.0,
        "samples": 256,
        "max_depth": 3,
        "step_nm": 100.0,
    }
    slow, fast = (
        MitsubaRenderer(**settings, variant=v)(scene).radiance.values for v in ("scalar", "auto")
    )
    assert fast.max() > 0
    # 5 %: the image of the lamp is 1 m wide, a third of the field, so 5400 of the paths hit it: 1.1
    # % of noise in each picture, 1.6 % in their difference
    assert slow.mean() == pytest.approx(fast.mean(), rel=0.05)


def test_the_scalar_way_renders_the_same_scene(make):
    """The scalar variant gives the same light of sky and lamps, and the same labels, without
    LLVM."""
    scene = make.street(2)
    settings = {
        "width": 16,
        "height": 9,
        "margin": 0.0,
        "max_depth": 3,
        "first_nm": 450.0,
        "last_nm": 650.0,
        "step_nm": 40.0,
    }
    demand = Demand(groups=("sky", "streetlights"), labels=frozenset({"instance", "distance"}))
    slow = MitsubaRenderer(**settings, variant="scalar", samples=256)(scene, demand)
    fast = MitsubaRenderer(**settings, samples=1024)(scene, demand)
    assert slow.radiance.dims == fast.radiance.dims and np.array_equal(
        slow.wavelength, fast.wavelength
    )
    # rays of different compilers may fall on either side of an edge: one tile of 144
    assert (slow.instance.values != fast.instance.values).sum() <= 1
    for group, tolerance in (("sky", 0.02), ("streetlights", 0.05)):
        a, b = (ds.radiance.sel(light_group=group).mean("wavelength").values for ds in (slow, fast))
        # 256 paths have some per cent of noise per tile; the median over tiles has a tenth of that
        lit = b > 0.01 * b.mean()
        assert np.median(a[lit] / b[lit]) == pytest.approx(1, abs=tolerance)
        assert a.mean() == pytest.approx(b.mean(), rel=2 * tolerance)


@pytest.mark.slow
def test_light_of_a_group_does_not_depend_on_which_others_are_asked_for(make):
    renderer = MitsubaRenderer(
        width=16, height=9, margin=0.0, samples=8, step_nm=100.0, max_depth=3, variant="scalar"
    )
    whole = renderer(make.street(2), Demand(groups=("sky", "headlights", "streetlights"))).radiance
    for group in ("headlights", "streetlights"):
        alone = renderer(make.street(2), Demand(groups=(group,))).radiance
        assert alone.values.any() and np.array_equal(
            alone.sel(light_group=group).values, whole.sel(light_group=group).values
        )


def test_the_scalar_way_needs_square_tiles(make):
    with pytest.raises(ConfigError, match="square tiles"):
        MitsubaRenderer(width=16, height=16, variant="scalar")(make.street(1))


@pytest.mark.parametrize(
    ("width", "aspect"), [(100, 16 / 9), (101, 1.6), (640, 2.0), (7, 1.234), (1, 4.0)]
)
def test_the_advice_on_square_tiles_is_taken(width, aspect):
    good = nearest_square(width, aspect)
    check_square(*good, aspect)  # the size that the message proposes is accepted
    assert abs(good[0] - width) <= 64
    with pytest.raises(ConfigError, match="type renderer.width="):
        check_square(width, round(width / aspect) + 1, aspect)


def test_tiles_that_are_not_square_are_refused_when_planned():
    config = compose(["renderer.variant=scalar", "renderer.width=100", "renderer.height=56"])
    with pytest.raises(ConfigError, match="renderer.width=96 renderer.height=54"):
        chain(config)


def test_the_ledger_says_what_the_lamps_extent_costs(make):
    rows = ledger.Ledger()
    with ledger.stage(rows, "renderer") as row:
        MitsubaRenderer(width=16, height=9, margin=0.0, samples=8, step_nm=100.0, variant="scalar")(
            make.street(2), Demand(groups=("streetlights",))
        )
    (note,) = (e for e in row.errors if e.how == "bound" and "point source" in e.label)
    # lamps of 0.8 x 0.4 m in pieces of at most 0.3 m, 7 m above the road: an error of about (0.2 /
    # 7)^2
    assert 1e-5 < note.value < 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("group", ["headlights", "streetlights", "other"])
def test_agrees_with_the_compiled_way(make, group):
    """Compare 8 independent pictures of each variant, for each light group."""
    settings = {
        "width": 48,
        "height": 27,
        "margin": 0.0,
        "samples": 128,
        "step_nm": 100.0,
        "max_depth": 4,
    }
    sums = {
        v: np.array(
            [
                light(
                    MitsubaRenderer(**settings, variant=v, seed=k)(
                        make.street(12), Demand(groups=(group,))
                    )
                )
                for k in range(8)
            ]
        )
        for v in ("scalar", "llvm")
    }
    blocks = {
        v: np.stack(
            [
                [b.sum() for r in np.array_split(p, 3, 0) for b in np.array_split(r, 4, 1)]
                for p in pile
            ]
        )
        for v, pile in sums.items()
    }
    a = blocks["scalar"]
    b = blocks["llvm"]
    lit = b.mean(0) > 1e-3 * b.mean()
    z = (a.mean(0) - b.mean(0))[lit] / np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1))[lit] / 8)
    # Student's t with 14 degrees of freedom; the extent of lamps and texels change a block by half
    # a per cent, up to a standard error
    assert abs(np.mean(z)) < 4 / np.sqrt(len(z)) and np.abs(z).max() < 5


def light(ds):
    """Return the luminance of the reflected light only.

    Tiles that show a lamp directly are set to 0; they would dominate all sums.
    """
    found = luminance(ds.radiance.values[0].astype(float), ds.wavelength.values)
    return np.where(found < 100 * np.median(found[found > 0]), found, 0)


def test_a_lamp_with_a_table_that_is_off_is_dark(make):
    """In place of 0 / 0, which rays that hit the lamp by chance would add to the picture."""
    import mitsuba as mi

    from isethdr_core.scene import IntensityTable, Lamp

    mi.set_variant(choose_variant("scalar"))
    from isethdr_mitsuba.lamps.beam_lamp import beam_lamp

    angles = np.linspace(-60.0, 60.0, 5)
    table = IntensityTable(angles, angles, np.ones((5, 5)))
    lamp = Lamp("drl", "headlights", 0.0, make.flat(1.0), table=table)
    scene = make.describe(
        [("lamp", "car", (make.part(make.quad(1, 1), "black", lamp),), make.pose())]
    )
    emitter = beam_lamp(placed_lamps(scene)[0], mirrored_only=True)
    assert emitter.grid_pattern([1.0, 0.0, 0.0], True) == 0.0
