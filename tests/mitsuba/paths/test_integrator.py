"""The integrator against closed forms and against Mitsuba's own path integrator."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.demand import Demand
from isethdr_core.physics.photometry import LM_PER_W, luminance, v_lambda
from isethdr_core.uncertainty import ledger

SMALL = {"width": 8, "height": 8, "margin": 0.0, "variant": "auto"}
NM = np.arange(360.0, 831.0)


def photopic(spectrum):
    """Return the luminance of a spectrum over all wavelengths, also beyond the bands."""
    return LM_PER_W * float(spectrum.at(NM) @ v_lambda(NM))


def test_a_uniform_sky_returns_its_own_spectrum(make):
    sky = make.spectrum((390.0, 500.0, 560.0, 720.0), (1e-3, 3e-3, 2e-3, 8e-3))
    ds = MitsubaRenderer(**SMALL, samples=4096)(make.describe([], sky=sky))
    assert ds.radiance.dims == ("light_group", "wavelength", "y", "x") and list(
        ds.light_group.values
    ) == ["sky"]
    edges = ds.wavelength.values[:, None] + np.linspace(-5, 5, 1001)
    truth = sky.at(edges).mean(1)
    # 3e-4: with 64 tiles x 4096 wavelengths in each band, the statistical error is below 1e-4;
    # float32 sums add 1e-5
    np.testing.assert_allclose(ds.radiance[0].mean(("y", "x")), truth, rtol=3e-4)


@pytest.mark.slow
def test_white_furnace(make):
    """Inside a closed diffuse sphere with uniform emission, radiance is emission / (1 -
    reflectance).
    """
    rho = 0.5
    mesh = sphere(12, inside_out=True)
    lamp = make.lamp("glow", "other", 1.0, make.flat(1.0), (1, 0, 0), 90.0, 90.0, 0.0)
    room = make.describe([("room", "chart", (make.part(mesh, "grey", lamp),), make.pose())])
    ds = MitsubaRenderer(**SMALL, samples=1024, max_depth=24)(room)
    got = luminance(ds.radiance.values[0], ds.wavelength.values)
    emitted = ds.attrs["lamps"][0]["luminance_cd_m2"] * photopic_share(ds, make.flat(1.0))
    # 3e-3: 24 segments omit 2^-23 of the light; the statistical error of 66 k paths is below 1.4e-3
    assert got.mean() / emitted == pytest.approx(1 / (1 - rho), rel=3e-3)


def photopic_share(ds, spectrum):
    """Return the share of a spectrum's luminance within the bands of `ds`."""
    return float(
        luminance(spectrum.at(ds.wavelength.values)[:, None], ds.wavelength.values)[0]
    ) / photopic(spectrum)


def sphere(n, inside_out):
    """Return a convex polyhedron; with constant emission its facets do not matter."""
    theta = np.linspace(0, np.pi, n + 1)
    phi = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
    v = np.array(
        [[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in theta for p in phi]
    )
    k = lambda i, j: i * 2 * n + j % (2 * n)
    f = [
        t
        for i in range(n)
        for j in range(2 * n)
        for t in ((k(i, j), k(i + 1, j), k(i + 1, j + 1)), (k(i, j), k(i + 1, j + 1), k(i, j + 1)))
    ]
    f = np.array(
        [t for t in f if np.linalg.norm(np.cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]])) > 1e-9]
    )
    return v * 2, f[:, ::-1] if inside_out else f


@pytest.mark.parametrize("distance_m", [10.0, 1e2, 1e3, 1e4])
def test_intensity_in_candela_gives_inverse_square_irradiance(make, distance_m):
    """A facing white wall at distance d has luminance rho / pi * I / d^2, whatever the lamp's
    area.
    """
    lamp = make.lamp("drl", "headlights", 500.0, make.flat(1.0), (1, 0, 0), 20.0, 40.0, 1e-3)
    wall = make.quad(0.01, 0.01)
    wall = wall[0] * [1, 1, 1] * 100, wall[1][:, ::-1]
    scene = make.describe(
        [
            (
                "lamp",
                "car",
                (make.part(make.quad(0.05, 0.05), "black", lamp),),
                make.pose(-distance_m),
            ),
            ("wall", "chart", (make.part(wall),), make.pose()),
        ],
        camera=make.camera((-1.0, 0.0, 0.3), (0, 0, 0), 1.0, 1.0),
    )
    ds = MitsubaRenderer(**SMALL, samples=256, max_depth=2)(scene)
    wanted = 0.5 / np.pi * 500.0 / distance_m**2 * photopic_share(ds, make.flat(1.0))
    got = luminance(ds.radiance.values[0], ds.wavelength.values).mean()
    # 5e-4: the lamp is 10 cm wide, so at 10 m its edges deviate from the inverse square law by
    # 2e-5; the noise is of the same order
    assert got == pytest.approx(wanted, rel=5e-4)


@pytest.mark.slow
def test_the_spread_of_passes_is_the_noise_of_the_mean(make):
    """The error stated for 128 paths is 1 / 0.6745 times the median deviation from a picture of
    many
    more paths.
    """
    scene = make.street(6)
    settings = {"width": 32, "height": 18, "margin": 0.0, "step_nm": 100.0}
    rows = ledger.Ledger()
    with ledger.stage(rows, "renderer") as row:
        few = MitsubaRenderer(**settings, samples=128, seed=5)(
            scene, Demand(groups=("streetlights",))
        )
    many = MitsubaRenderer(**settings, samples=1024, seed=6)(
        scene, Demand(groups=("streetlights",))
    )
    a, b = (luminance(ds.radiance.values[0], ds.wavelength.values) for ds in (few, many))
    lit = (b > 0.01 * b.mean()) & (b < 100 * b.mean())
    found = np.median(np.abs(a[lit] / b[lit] - 1)) / 0.6745
    # The picture with eight times the paths adds 6 % to the deviation. Four passes determine a
    # standard error to 40 %, and its median over tiles better. The two medians weight tiles
    # differently.
    assert row.errors[0].part == "streetlights" and 0.4 < row.errors[0].value / found < 2.5


def test_same_seed_gives_the_same_cube_and_another_seed_does_not(make):
    street = make.street(4)
    render = lambda seed: (
        MitsubaRenderer(width=32, height=18, samples=4, seed=seed, step_nm=100.0)(
            street
        ).radiance.values
    )
    one = render(1)
    assert np.array_equal(one, render(1))
    assert not np.array_equal(one, render(2))


@pytest.mark.slow
def test_a_group_is_the_same_bit_for_bit_when_the_others_are_not_rendered(make):
    """A group that is not rendered is absent from the result, not black."""
    scene = make.street(6)
    renderer = MitsubaRenderer(width=48, height=27, samples=8)
    whole = renderer(scene)
    assert list(whole.light_group.values) == ["sky", "headlights", "other", "streetlights"]
    rows = ledger.Ledger()
    for name in ("sky", "streetlights"):
        with ledger.stage(rows, name) as row:
            alone = renderer(scene, Demand(groups=(name,)))
        assert list(alone.light_group.values) == [name]
        assert np.array_equal(alone.radiance.values[0], whole.radiance.sel(light_group=name).values)
        groups = {o.what for o in row.left_out if o.what.startswith("light group")}
        assert groups == {f"light group {g}" for g in whole.light_group.values if g != name}


@pytest.mark.slow
def test_all_lamps_in_one_group_give_the_sum_of_the_groups(make):
    """Compare with an estimate with other random numbers and another choice of lamps."""
    from dataclasses import replace

    scene = make.street(6)
    renderer = MitsubaRenderer(width=32, height=18, samples=512, margin=0.0)
    parts = renderer(scene, Demand(groups=("headlights", "other", "streetlights")))

    def merged(model):
        return replace(
            model,
            parts=tuple(
                replace(p, lamp=p.lamp and replace(p.lamp, group="all")) for p in model.parts
            ),
        )

    one = renderer(
        replace(scene, models={k: merged(m) for k, m in scene.models.items()}),
        Demand(groups=("all",)),
    )
    a = parts.radiance.sum("light_group").values.mean(0)
    b = one.radiance.values[0].mean(0)
    lit = a > 0.01 * a.mean()
    # the median signed relative difference of two noisy pictures of 512 paths, over 100 tiles,
    # shows no bias above 1 %
    assert lit.sum() > 80 and abs(np.median(b[lit] / a[lit] - 1)) < 0.01


def test_only_the_bands_asked_for_are_rendered(make):
    scene = make.describe([], sky=make.flat(1e-3))
    ds = MitsubaRenderer(**SMALL, samples=4)(scene, Demand(wavelength_nm=(505.0, 600.0)))
    assert list(ds.wavelength.values) == [500.0, 510.0, 600.0]


@pytest.mark.parametrize(
    "group",
    [
        "headlights",
        pytest.param("streetlights", marks=pytest.mark.slow),
        pytest.param("other", marks=pytest.mark.slow),
        pytest.param("sky", marks=pytest.mark.slow),
    ],
)
def test_agrees_with_mitsubas_own_path_integrator(make, group):
    """Compare with Mitsuba's path integrator, which has independent code.

    It differs in lamps (emitter plugin), colours (spectral surfaces), the choice of lamps, and
    bands (a spectral film).
    """
    settings = {
        "width": 48,
        "height": 27,
        "margin": 0.0,
        "samples": 512 if group == "headlights" else 2048,
        "step_nm": 40.0,
        "last_nm": 680.0,
        "max_depth": 4,
    }
    blocks = lambda pile: np.stack(
        [
            [b.mean() for r in np.array_split(p, 9, 0) for b in np.array_split(r, 12, 1)]
            for p in pile
        ]
    )
    # (repeat, block)
    ours, theirs = (
        blocks(pictures(make, make.street(12), settings, group, way).mean(1))
        for way in ("path", "own")
    )
    repeats = len(ours)
    error = np.sqrt((ours.var(0, ddof=1) + theirs.var(0, ddof=1)) / repeats)
    lit = ours.mean(0) > 1e-3 * ours.mean()
    z = ((ours.mean(0) - theirs.mean(0)) / np.maximum(error, 1e-300))[lit]
    assert lit.sum() > 30
    # The z of means of 8 and 8 pictures is Student's t with 14 degrees of freedom: standard
    # deviation 1.08. Blocks share no path, so the mean of n blocks is within 4 / sqrt(n). Fireflies
    # make the tails heavier, so 1.5 is allowed.
    assert abs(z.mean()) < 4 / np.sqrt(len(z))
    assert 0.5 < z.std() < 1.5
    # a bias hidden in the noise of single blocks would show in the median block: 2 %
    assert np.median((ours.mean(0) / np.maximum(theirs.mean(0), 1e-300))[lit]) == pytest.approx(
        1, abs=0.02
    )


def test_one_kernel_for_all_passes_light_groups_and_scenes(make):
    """Scenes and passes that differ only in numbers reuse the first compiled kernel.

    Compilation takes longer than many passes.
    """
    import drjit as dr
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))

    def kernels(scene, size, lots):
        settings = MitsubaRenderer(width=size[0], height=size[1], step_nm=100.0, max_depth=3)
        one_pass = compiled(scene, settings, scene.light_groups())
        found = set()
        for lot in lots:
            dr.kernel_history_clear()
            with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
                list(one_pass(7 + len(lot), 1 + len(lot), lot))
            ran = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            # only kernels that trace paths; others are copies and similar
            found |= {k["hash"] for k in ran if k["operation_count"] > 1000}
        return found

    # boxes, camera, grid, number of lamps and lots of groups differ; the kinds of surfaces are the
    # same
    assert (
        len(
            kernels(make.street(3, seed=1), (12, 7), [(0, 1, 2, 3), (1, 3), (0,)])
            | kernels(make.street(5, seed=8), (16, 9), [(0, 1, 2, 3)])
        )
        == 1
    )


@pytest.mark.slow
def test_hits_are_those_of_mitsuba(make):
    """Compare hits by tables of triangles with those of Mitsuba's own shapes.

    The shapes are placed once or as instances, turned, mirrored and stretched, flat and smooth.
    """
    from dataclasses import replace

    import drjit as dr
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.paths.hits import HitTables
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces

    ball = make.part(sphere(6, False))
    ball = replace(ball, normals=ball.vertices / 2)
    # more than ten names, since "box10" sorts before "box2"
    row = [
        make.part((make.cube[0] * 0.2 + [0.4 * k, 0.1 * k, 2.0], make.cube[1]), name=f"box{k}")
        for k in range(12)
    ]
    once = make.part((make.cube[0] * 1.8, make.cube[1]), "black", name="once")
    squeezed = make.pose(12, -4, 1, 40) @ np.diag([1, 0.5, 2, 1])
    placed = [
        ("ball", "chart", (ball, *row), make.pose(9, 2, 0, 30)),
        ("once", "chart", (once, ball), make.pose(12, 6, 0, 10)),
    ]
    scene = make.describe(placed, sky=make.flat(1.0))
    again = [
        replace(scene.objects[0], name=f"more{k}", pose=pose)
        for k, pose in enumerate((squeezed, make.pose(15, 0, -2) @ np.diag([1, -1, 1, 1])))
    ]
    world = build_world(
        described := replace(scene, objects=(*scene.objects, *again)), ramp_surfaces(described)
    )
    rng = np.random.default_rng(3)
    across, up = (rng.uniform(-0.6, 0.6, 20000).astype(np.float32) for _ in range(2))
    ray = mi.Ray3f(
        mi.Point3f(0, 0, 0), dr.normalize(mi.Vector3f(1, mi.Float(across), mi.Float(up)))
    )
    ours, shape = HitTables(world).meet(world.scene, ray, mi.Bool(True))
    theirs = world.scene.ray_intersect(ray)
    hit = np.array(theirs.is_valid())
    number = lambda pointer: np.array(dr.reinterpret_array(mi.UInt32, pointer))[hit]
    assert (
        np.array_equal(np.array(ours.is_valid()), hit)
        and set(number(theirs.instance)) > {0}
        and len(set(number(theirs.instance))) == 4
    )
    assert (
        np.array_equal(np.array(shape)[hit], number(theirs.shape))
        and len(set(number(theirs.shape))) == 15
    )
    # tolerances: a few float32 roundings of coordinates up to 20 m and of unit vectors; t is the
    # same number in both
    for value, off in (
        (lambda si: si.t, 0),
        (lambda si: si.p, 1e-5),
        (lambda si: si.n, 3e-6),
        (lambda si: si.sh_frame.n, 1e-5),
        (lambda si: si.wi.z, 3e-5),
    ):
        a, b = (np.array(value(si))[..., hit] for si in (ours, theirs))
        np.testing.assert_allclose(a, b, rtol=0, atol=off)


def pictures(make, scene, settings, group, way, repeats=8):
    """Return `repeats` independent pictures (band, y, x) without lamps seen directly.

    `way` is `path` for the project's integrator, `own` for Mitsuba's.
    """
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
    from isethdr_mitsuba.world.view import view_of

    renderer = MitsubaRenderer(**settings)
    view = view_of(scene.camera, renderer.width, renderer.height, 0.0)
    lamps = placed_lamps(scene)
    bands = renderer._bands(None)
    if way == "own":
        render = make.mitsubas_own(scene, renderer, view, lamps, group, bands)
        return np.stack(
            [render(100 + k, renderer.samples // repeats) for k in range(repeats)]
        ).astype(float)
    one_pass = compiled(scene, renderer, [group])
    out = np.zeros((repeats, len(bands), *view.shape))
    for k in range(repeats):
        for _, band, values in one_pass(100 + k, renderer.samples // repeats):
            out[k, band] = np.reshape(values, view.shape)
    return out


def compiled(scene, renderer, groups):
    """Return the function of one pass of the project's integrator over `groups` of a scene."""
    from isethdr_mitsuba.frame import even_passes

    return even_passes(follower(scene, renderer, groups))


def follower(scene, renderer, groups):
    """Return the project's integrator over `groups` of a scene."""
    from isethdr_mitsuba import frame
    from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    view = view_of(scene.camera, renderer.width, renderer.height, 0.0)
    surfaces = ramp_surfaces(scene)
    return frame.follower(
        scene,
        frame.Built(build_world(scene, surfaces), surfaces),
        placed_lamps(scene),
        frame.Cube(list(groups), renderer._bands(None), view),
        renderer,
    )
