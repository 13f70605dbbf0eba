"""Light groups reused from another frame equal those of a new rendering."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.demand import Demand, NoiseLimit
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.uncertainty.ledger import Ledger

SIZE = {"width": 24, "height": 16, "margin": 0.0, "step_nm": 100.0, "max_depth": 3}
LABELS = frozenset({"distance", "instance"})
WEIGHTS = {"sky": 1.0, "headlights": 1.0, "other": 1.0, "streetlights": 1.0}
SHARE = 0.5
LABELLED = Demand(labels=LABELS)
IN_SEQUENCE = {}  # carried exposures: none


@dataclass(frozen=True)
class Street:
    """A street at night with tail lamps `factor` times as bright, or off at 0.

    The camera has moved forwards by `driven_m`.
    """

    make: ClassVar[Any] = None
    factor: float = 1.0
    driven_m: float = 0.0

    def __call__(self):
        scene = self.make.street(6)
        models = {name: self.switched(model) for name, model in scene.models.items()}
        along = lambda place: (place[0] + self.driven_m, *place[1:])
        camera = scene.camera
        camera = replace(
            camera, position_m=along(camera.position_m), target_m=along(camera.target_m)
        )
        return replace(scene, models=models, camera=camera)

    def switched(self, model):
        return replace(model, parts=tuple(map(self.part, model.parts)))

    def part(self, part):
        if part.lamp is None or part.lamp.group != "other":
            return part
        if not self.factor:
            return replace(part, lamp=None)
        candela = part.lamp.intensity_cd * self.factor
        return replace(part, lamp=replace(part.lamp, intensity_cd=candela))


@pytest.fixture(autouse=True)
def made(make, monkeypatch):
    monkeypatch.setattr(Street, "make", make)


def frame(home, monkeypatch, scene, demand=LABELLED, exposures=IN_SEQUENCE, **settings):
    """Return the scene radiance of a frame, and its ledger."""
    monkeypatch.setenv("ISETHDR_HOME", str(home))
    renderer = MitsubaRenderer(**{**SIZE, "samples": 16, "variant": "llvm", **settings})
    chain = SimpleNamespace(
        scene=scene,
        renderer=renderer,
        lighting=None,
        versions={},
        leave_out=True,
        exposures=exposures,
    )
    config = SimpleNamespace(
        scene=SimpleNamespace(name="street"), renderer=SimpleNamespace(name="mitsuba")
    )
    rows = Ledger()
    return scene_radiance(chain, demand, rows, config)[0].load(), rows


def luminance(light):
    """Return {group: luminance (row, column)}."""
    planes = np.einsum("b,gbyx->gyx", xyz_weights(light.wavelength.values)[1], light.radiance)
    return dict(zip(map(str, light.light_group.values), planes))


@dataclass(frozen=True, eq=False)
class LikeACamera:
    """The noise limit of a camera: shot noise of the light of all groups, and a floor."""

    electrons: float = 30.0  # per cd/m2

    def __call__(self, light):
        assert set(map(str, light.light_group.values)) == set(WEIGHTS), "of all groups"
        level = sum(luminance(light).values())
        limit = np.sqrt(level * self.electrons + 1) / self.electrons
        return NoiseLimit(WEIGHTS, np.stack([limit] * 3))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "taken"),
    [(3.0, {"sky", "headlights", "streetlights"}), (0.0, {"headlights", "streetlights"})],
)
def test_light_beside_a_lamp_that_changes_is_that_of_a_new_rendering_bit_for_bit(
    tmp_path, monkeypatch, factor, taken
):
    frame(tmp_path / "sequence", monkeypatch, Street())
    now = Street(factor)
    light, _ = frame(tmp_path / "sequence", monkeypatch, now)
    anew, _ = frame(tmp_path / "alone", monkeypatch, now)
    assert set(light.attrs["groups_from"]) == taken
    assert not anew.attrs["groups_from"]
    for name in anew.data_vars:
        np.testing.assert_array_equal(light[name].values, anew[name].values)
    for key in ("noise", "path_span", "objects"):
        assert light.attrs[key] == anew.attrs[key]
    told, expected = (
        {(one["object"], one["kind"], one["luminance_cd_m2"]) for one in scene.attrs["lamps"]}
        for scene in (light, anew)
    )
    assert told == expected


@pytest.mark.slow
def test_by_need_the_group_that_changes_meets_the_limit_beside_the_others(tmp_path, monkeypatch):
    by_need = Demand(labels=LABELS, noise_limit=LikeACamera())
    settings = {"samples": None, "noise_share_allowed": SHARE}
    frame(tmp_path / "sequence", monkeypatch, Street(), by_need, **settings)
    now = Street(2.0)
    light, _ = frame(tmp_path / "sequence", monkeypatch, now, by_need, **settings)
    assert set(light.attrs["groups_from"]) == {"sky", "headlights", "streetlights"}
    judge = luminance(frame(tmp_path / "judge", monkeypatch, now, samples=2048)[0])
    limit = LikeACamera()(light).xyz[1]
    stated = np.sqrt((light.xyz_noise.values[:, 1] ** 2).sum(0))
    # one tile in a hundred may exceed the limit, and numbers of paths are whole steps
    assert np.quantile(stated / limit, 0.95) < 1.3 * SHARE
    found = luminance(light)
    error = (sum(found.values()) - sum(judge.values())) / limit
    assert np.quantile(np.abs(error), 0.9) < 2 * SHARE  # as for a new rendering of all groups
    for g, group in enumerate(found):
        noise = np.sqrt((light.xyz_noise.values[g, 1] ** 2).sum())
        # in the group with the rarest light, 24 renderings spread twice as widely as stated
        assert found[group].sum() == pytest.approx(
            judge[group].sum(), abs=10 * noise + 1e-4 * judge[group].sum()
        )


@pytest.mark.slow
def test_light_too_noisy_for_what_a_frame_allows_is_rendered_anew(tmp_path, monkeypatch):
    settings = {"samples": None, "noise_share_allowed": SHARE}
    first, second = (Demand(labels=LABELS, noise_limit=LikeACamera(n)) for n in (30.0, 300.0))
    frame(tmp_path, monkeypatch, Street(), first, **settings)
    light, rows = frame(tmp_path, monkeypatch, Street(2.0), second, **settings)
    assert not light.attrs["groups_from"]
    [note] = [n for row in rows for n in row.left_out if n.key == "equal groups"]
    assert "too noisy" in note.why


@pytest.mark.slow
def test_render_noise_of_frames_that_move_is_uncorrelated_and_not_a_frozen_pattern(
    tmp_path, monkeypatch
):
    drives = [Street(driven_m=way_m) for way_m in (0.0, 1e-3)]  # much less than a tile
    judges = [
        luminance(frame(tmp_path / "judge", monkeypatch, scene, samples=1024, seed=7)[0])["sky"]
        for scene in drives
    ]
    correlation = {}
    for kind, exposures in (("sequence", {}), ("single shots", None)):
        home = tmp_path / kind
        lights = [frame(home, monkeypatch, scene, exposures=exposures)[0] for scene in drives]
        # light of the sky has no rare paths, whose skewed noise would be correlated
        noise = [luminance(one)["sky"] / judge - 1 for one, judge in zip(lights, judges)]
        used = (np.abs(noise) > 1e-3).all(0)  # a tile that shows only sky has no noise
        correlation[kind] = np.corrcoef(noise[0][used], noise[1][used])[0, 1]
    # the correlation of n independent values has a standard deviation of 1 / sqrt(n)
    assert abs(correlation["sequence"]) < 4 / np.sqrt(used.sum())
    assert correlation["single shots"] > 0.5  # same seed, same pattern
