"""Pairs: terms add up to the whole light, noise averages out, and files are complete or absent."""

from __future__ import annotations

import contextlib
import errno
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from isethdr_workflows.dataset import actions
from isethdr_workflows.dataset.pairs import files, making
from isethdr_workflows.dataset.pairs.making import imaged, make_pairs, samples_of
from isethdr_workflows.dataset.pairs.request import PairRequest, pair_request
from isethdr_workflows.dataset.pairs.sources import sources
from isethdr_workflows.dataset.record import folder_of

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.storage.store import write_store
from isethdr_core.uncertainty.ledger import collected

STORE = "5ce4e00000000001-00000000"
ROUNDING = 2.0**-22  # relative error of a sum of float32 numbers, each rounded once
SETTINGS = (
    "sensor=bayer",
    "sensor.rows=12",
    "sensor.columns=16",
    # without fixed pattern, the mean over shots of one device is the raw without noise
    *(f"sensor.{name}=0" for name in ("prnu", "dark_spread", "dsnu_e", "column_e")),
    "sensor.bits=0",  # raw is electrons, without rounding
    "lens=diffraction_limited",
    "lens.f_number=8",
    "lens.falloff=none",
    "flare.dirt.dust_per_mm2=150",
    "+flare@flare.ghosts=ghosts_broadband",
    "flare.ghosts.sensor_reflectance_percent=0",
    "lighting=day",
    "lighting.others=1",
    "leave_out=false",
    *(f"~metric.{name}" for name in ("shares", "dynamic_range", "snr", "colour", "ssim")),
    *(f"~metric.{name}" for name in ("log_luminance", "contrast", "detection")),
)


def stored_scene(folder: Path) -> None:
    """Write a chart of five lamps over a grey field as stored radiance."""
    chart = build(
        "scene",
        "point_lights",
        width=16,
        height=12,
        horizontal_field_deg=0.86,  # a tile is a pixel of 3.75 um
        luminance_cd_m2=1e5,
        background_cd_m2=1.0,
        disc_diameter_deg=0.1,
        discs=2,
        first_nm=450.0,
        last_nm=650.0,
        step_nm=200.0,
    )()
    write_store(folder / "scenes", STORE, {"": chart}, {"kind": "scene", "recipe": STORE[:16]})


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Return the home folder with the scene, the request, the light and the sample, made once."""
    folder = tmp_path_factory.mktemp("pairs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISETHDR_HOME", str(folder))
        patch.setenv("ISETHDR_CACHE", str(folder / "cache"))
        stored_scene(folder)
        request = PairRequest(STORE, shots=12, blur=True, overrides=SETTINGS)
        [source] = sources(request)
        seen = imaged(source, blur=True)
        with contextlib.ExitStack() as stack:
            stack.enter_context(pytest.MonkeyPatch.context()).setattr(
                making, "imaged", lambda *_: seen
            )
            [sample] = samples_of(source, request)
    return folder, request, seen, sample


@pytest.fixture
def quick(world, isethdr_home, monkeypatch):
    """Return a request for the scene of `world`, which is imaged already."""
    folder, request, seen, sample = world
    monkeypatch.setenv("ISETHDR_HOME", str(folder))
    monkeypatch.setattr(making, "samples_of", lambda *_: [sample])
    monkeypatch.setattr(making, "built_for", lambda _source: (None, seen.chain))
    return replace(request, folder=isethdr_home / "pairs")


@pytest.mark.slow
def test_the_terms_are_named_and_add_up_to_the_light_of_the_run(world):
    """One call of the lens computes the whole light here; the flare alone computes the ghosts."""
    _, _, seen, sample = world
    assert sample.labels["terms"] == ["sharp", "blur", "scatter", "ghosts"]
    assert sample.labels["members"] == ["sharp", "no_flare", "no_ghosts", "full"]
    terms = [sample.arrays[f"electrons_{term}"].astype(float) for term in sample.labels["terms"]]
    [sensor] = seen.chain.cameras.values()
    flares = seen.chain.flares
    dark = sample.labels["of_captures"]["dark_e"][0]

    def electrons(light):
        return sensor.expected(light).values - dark

    at_once = electrons(seen.chain.lens(seen.mixed, flares=tuple(flares.values())))
    size = sum(np.abs(term) for term in terms)
    assert np.all(np.abs(at_once - sum(terms)) <= ROUNDING * size)
    clean = electrons(seen.chain.lens(seen.mixed))
    assert np.all(np.abs(clean - terms[0] - terms[1]) <= ROUNDING * size)
    ghosts = collected(lambda: flares["ghosts"].irradiance(seen.chain.lens, seen.mixed)).result
    alone = electrons(seen.light["no_ghosts"].copy(data=ghosts.values.astype(np.float32)))
    # light is summed in float32, so a ghost is as inexact as the image that it lies on
    assert np.all(np.abs(alone - terms[3]) <= 8 * ROUNDING * size)
    assert alone.max() > 1e-3  # electrons; ghosts are not left out


def test_dirt_spreads_light_and_takes_light_away(world):
    """Scatter dims the lamp and lights its surroundings, and creates no light. The aperture passes
    the share that the light states; light that leaves the frame is missing too.
    """
    _, _, seen, sample = world
    lens = sample.arrays["electrons_sharp"] + sample.arrays["electrons_blur"]
    scatter = sample.arrays["electrons_scatter"]
    assert scatter.min() < 0 < scatter.max()
    lamp = np.unravel_index(np.argmax(lens), lens.shape)
    assert scatter[lamp] < 0
    passed = seen.light["no_ghosts"].attrs["throughput_sr"]
    passed /= seen.light["no_flare"].attrs["throughput_sr"]
    kept = 1 + float(scatter.sum() / lens.sum())
    assert 0.5 * passed < kept <= passed * (1 + 1e-4) < 1


def test_a_sharp_image_is_the_channel_radiance_through_the_camera_equation(world):
    """Electrons = radiance x throughput x area x exposure, where tiles are pixels."""
    _, _, seen, sample = world
    figures = sample.labels["of_captures"]
    factor = (
        sample.labels["of_camera"]["throughput_sr"]
        * figures["area_m2"][0]
        * figures["exposure_s"][0]
    )
    throughput = seen.light["sharp"].attrs["throughput_sr"]
    factor *= throughput / sample.labels["of_camera"]["throughput_sr"]
    planes = sample.arrays["channel_radiance"] * factor
    channel = np.take_along_axis(planes, sample.arrays["filter"][None].astype(int), 0)
    # 1e-5: the radiance, the light and both results are rounded to float32
    np.testing.assert_allclose(sample.arrays["electrons_sharp"], channel, rtol=1e-5)


def test_noise_averages_to_the_raw_without_noise(world):
    """Twelve shots of about 180 pixels. z has Student's distribution with 11 degrees of freedom, so
    a variance of 11/9. Standard errors are 0.16 for the estimate of this variance and 0.08 for the
    mean of z.
    """
    _, _, _, sample = world
    for member in ("full", "no_flare"):
        noisy = sample.arrays[f"noisy_{member}"][:, 0].astype(float)
        usable = ~sample.arrays[f"saturated_{member}"][0]
        z = noisy.mean(0) - sample.arrays[f"raw_{member}"][0]
        z = (z / (noisy.std(0, ddof=1) / np.sqrt(len(noisy))))[usable]
        assert z.size > 120
        assert np.mean(z**2) == pytest.approx(11 / 9, abs=0.5)
        assert abs(z.mean()) < 0.25
    assert np.any(sample.arrays["noisy_full"][0] != sample.arrays["noisy_full"][1])


def test_labels_have_units_boxes_and_what_reads_a_dn_back(world):
    _, _, _, sample = world
    labels = sample.labels
    assert {row["unit"] for row in labels["arrays"].values()} >= {"DN", "cd m-2, Y is luminance"}
    assert set(labels["arrays"]) == set(sample.arrays)
    assert [row["name"] for row in labels["objects"]] == ["disc 1", "disc 2"]
    assert sorted(np.unique(sample.arrays["instance"])) == [0, 1, 2]
    raw = sample.arrays["raw_full"][0].astype(float)
    figures = labels["of_captures"]
    electrons = (raw - figures["black_dn"][0]) / figures["gain_dn_per_e"][0] - figures["dark_e"][0]
    terms = sum(sample.arrays[f"electrons_{term}"][0].astype(float) for term in labels["terms"])
    usable = ~sample.arrays["saturated_full"][0]
    # raw is float32
    np.testing.assert_allclose(electrons[usable], terms[usable], rtol=1e-5, atol=1e-2)


@pytest.mark.parametrize("form", ["numpy", "exr"])
def test_files_hold_the_arrays(quick, form):
    lines = []
    made = make_pairs(replace(quick, format=form), lines.append)
    assert made.scenes == 1 and not made.failed and len(lines) == 1
    [text] = (made.folder / STORE).glob("*.json")
    labels = json.loads(text.read_text())
    path = text.parent / labels["file"]
    assert files.sha256(path) == labels["sha256"]
    sample = making.samples_of(None, quick)[0]
    if form == "numpy":
        with np.load(path) as read:
            assert all(np.array_equal(read[name], sample.arrays[name]) for name in sample.arrays)
        return
    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = {
            part.name(): {name: channel.pixels for name, channel in part.channels.items()}
            for part in file.parts
        }
    assert set(parts) == set(sample.arrays)
    xyz = np.stack([parts["xyz"][letter] for letter in "XYZ"], -1)
    np.testing.assert_array_equal(xyz, sample.arrays["xyz"])
    third = parts["noisy_full"][f"{labels['captures'][0]}_3"]
    np.testing.assert_array_equal(third, sample.arrays["noisy_full"][3, 0].astype(np.float32))
    card = (made.folder / "README.md").read_text()
    assert "`electrons_scatter`" in card and "MIT licence" in card
    assert card.count("\n| `") == len(sample.arrays) + 4 + 4


def test_the_page_reads_the_pairs(quick, capsys):
    """The Python of the page runs as it is printed."""
    make_pairs(quick, lambda _line: None)
    page = Path(__file__).parents[3] / "docs" / "how-to" / "pairs.md"
    code = page.read_text().partition("```python\n")[2].partition("```")[0]
    names = {"FOLDER": str(quick.target)}
    exec(code, names)
    assert capsys.readouterr().out == f"{STORE} bayer (1, 12, 16) (1, 12, 16) 0\n"
    [labels] = (labels for labels, _ in names["pairs"](quick.target))
    assert labels["terms"] == ["sharp", "blur", "scatter", "ghosts"]
    usable = ~np.load(quick.target / STORE / "bayer.npz")["saturated_full"]
    # a network is to remove this difference: noise, dirt and ghosts, here a few electrons around
    # the lamps
    assert np.isfinite((names["noisy"] - names["clean"])[usable]).all()


def test_an_interrupted_scene_leaves_nothing_and_is_made_again(quick, monkeypatch):
    def killed(_path):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(files, "sha256", killed)
        with pytest.raises(KeyboardInterrupt):
            make_pairs(quick, print)
    assert [path.name for path in quick.target.iterdir()] == ["pairs.json"]
    lines = []
    assert make_pairs(quick, lines.append).scenes == 1
    assert make_pairs(quick, lines.append).scenes == 1
    assert "MB" in lines[0] and lines[1].endswith("written before")


def test_pairs_of_a_dataset_that_was_made_again_are_not_mixed(quick):
    make_pairs(quick, lambda _line: None)
    labels = quick.target / STORE / "bayer.json"
    labels.write_text(labels.read_text().replace("lighting=day", "lighting=dusk"))
    with pytest.raises(ConfigError, match="another recipe or seed.*folder=pairs_2"):
        make_pairs(quick, print)


def test_two_processes_may_write_the_same_pairs(world, tmp_path):
    sample = world[3]
    sizes = [files.write_scene(tmp_path, STORE, [sample], "numpy") for _ in range(2)]
    assert sizes[0] == sizes[1] > 0
    assert [path.name for path in tmp_path.iterdir()] == [STORE]


def test_a_full_disk_is_one_line(quick, monkeypatch):
    def full(_path, _sample):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setitem(files.WRITERS, "numpy", (full, ".npz"))
    with pytest.raises(CatalogError, match=r"No space left on device; pairs .* make room") as err:
        make_pairs(quick, print)
    assert "\n" not in str(err.value)
    assert [path.name for path in quick.target.iterdir()] == ["pairs.json"]


def test_a_scene_that_fails_is_named_and_the_exit_code_says_so(quick, monkeypatch, capsys):
    [source] = sources(quick)
    right = making.samples_of

    def failing(one, request):
        if one.name == "dark":
            raise ValueError("no light\nat all")
        return right(one, request)

    both = [replace(source, name="dark"), source]
    monkeypatch.setattr(making, "sources", lambda _request: both)
    monkeypatch.setattr(making, "samples_of", failing)
    made = make_pairs(quick, print)
    assert made.scenes == 1 and made.failed == (("dark", "ValueError: no light"),)
    assert "failed: ValueError: no light" in capsys.readouterr().out


def test_if_all_scenes_fail_no_folder_is_left(quick, monkeypatch):
    def failing(*_):
        raise ValueError("no light\nat all")

    monkeypatch.setattr(making, "samples_of", failing)
    with pytest.raises(ConfigError, match="all scenes failed, .* because: ValueError: no light$"):
        make_pairs(quick, print)
    assert not quick.target.exists()
    quick.target.mkdir()
    (quick.target / "notes.txt").write_text("of the user")
    with pytest.raises(ConfigError, match="all scenes failed"):
        make_pairs(quick, print)
    assert (quick.target / "notes.txt").exists()


def test_a_camera_without_noise_is_told_to_have_no_noisy_shots(quick, world, monkeypatch):
    chain = replace(world[2].chain, cameras={"ideal": build("sensor", "ideal")})
    monkeypatch.setattr(making, "built_for", lambda _source: (None, chain))
    lines = []
    make_pairs(quick, lines.append)
    assert lines[0] == "no array noisy_* for ideal: without noise, all shots are equal"


def test_a_folder_of_other_settings_is_not_mixed(quick):
    make_pairs(quick, lambda _line: None)
    with pytest.raises(ConfigError, match=r"shots=12, but 2 was typed.*folder=pairs_2"):
        make_pairs(replace(quick, shots=2), print)
    (quick.target / "pairs.json").write_text("{")
    with pytest.raises(CatalogError, match="is damaged"):
        make_pairs(quick, print)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["format=png"], "format is 'png'"),
        (["shots=many"], "expected a whole number; type for example shots=4"),
        (["shots=65"], "expected 0 to 64"),
        (["scenes=0"], "scenes is 0"),
        (["blur=yes"], "expected true or false"),
        (["renderer.width=320"], "renderer.width=320 has no effect"),
        (["+scene.hour=9"], "scene.hour=9 has no effect"),
        (["motion.within_exposure=true"], "stored radiance of one moment"),
    ],
)
def test_mistakes_in_settings_are_named(settings, message):
    with pytest.raises(ConfigError, match=message):
        pair_request("night", settings)


def test_a_name_that_is_not_there(isethdr_home):
    with pytest.raises(CatalogError, match="no dataset or scene is named 'nigth'"):
        sources(PairRequest("nigth"))
    path = isethdr_home / "scenes" / "night"
    with pytest.raises(CatalogError, match="no dataset or scene is named"):
        sources(PairRequest(str(path)))
    folder = folder_of("empty")
    folder.mkdir(parents=True)
    definition = {"name": "empty", "seed": 0, "count": 1, "recipe_name": "roads"}
    text = json.dumps(
        definition | {"recipe_text": "", "overrides": [], "versions": {}, "created": ""}
    )
    (folder / "dataset.json").write_text(text)
    with pytest.raises(ConfigError, match="has no scene yet"):
        sources(PairRequest("empty"))


def test_what_does_not_fit_is_found_before_any_light(quick, world, monkeypatch):
    _, _, seen, _ = world
    monkeypatch.setattr(making, "samples_of", lambda *_: pytest.fail("imaged"))
    fast = replace(seen.chain, lens=replace(seen.chain.lens, f_number=1.6))
    monkeypatch.setattr(making, "built_for", lambda _source: (None, fast))
    with pytest.raises(ConfigError, match="opens to f/3"):
        make_pairs(quick, print)
    traced = replace(seen.chain, lens=build("lens", "prescription"), flares={})
    monkeypatch.setattr(making, "built_for", lambda _source: (None, traced))
    with pytest.raises(ConfigError, match="blur=true needs a lens"):
        make_pairs(quick, print)
    ideal = replace(seen.chain, lens=build("lens", "ideal"))
    monkeypatch.setattr(making, "built_for", lambda _source: (None, ideal))
    with pytest.raises(ConfigError, match="no pupil for the flare"):
        make_pairs(replace(quick, blur=False), print)
    assert not quick.target.exists()


def test_the_command_prints_where_the_pairs_are(quick, capsys):
    actions.pair(STORE, [f"folder={quick.target}", "shots=12", "blur=true", *SETTINGS])
    out = capsys.readouterr().out
    assert f"pairs:\n{quick.target}" in out and "pairs of 1 scene are written" in out
