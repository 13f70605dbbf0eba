"""The accuracy study's use of the renderer: the same renderings as separate calls, known lamps,
noise that falls.
"""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_measured.accuracy import transport
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_workflows.accuracy import point

from isethdr_core.display.preview import denoised, tristimulus


@pytest.mark.slow
def test_runs_on_one_scene_are_renderings_of_their_own(make, monkeypatch):
    monkeypatch.setattr(point, "SHORT_S", 0.0)
    scene = make.street()
    render = MitsubaRenderer(
        width=48, height=27, margin=0.0, first_nm=450, last_nm=650, step_nm=50, max_depth=3
    )
    runs = [{"samples": 512, "seed": 97}, {"samples": 8, "seed": 1}]
    (long, _, _), (few, cpu_s, _) = transport.of_paths(
        render, scene, runs, transport.LABELS, repeat=1
    )
    alone = replace(render, samples=8, seed=1)(scene)
    seen = few.source_seen.values
    sky = ~np.isfinite(few.distance.values)
    paths = ~seen[:, None] & np.ones(alone.radiance.shape, bool)
    # lamps are added in float32
    np.testing.assert_allclose(few.radiance.values[paths], alone.radiance.values[paths], rtol=1e-5)
    np.testing.assert_allclose(
        few.radiance.values,
        alone.radiance.values,
        rtol=1e-5,
        atol=1e-6 * float(alone.radiance.max()),
    )
    np.testing.assert_allclose(few.xyz_noise.values, alone.xyz_noise.values, rtol=1e-6)
    assert cpu_s > 0 and few.attrs["noise"] == pytest.approx(alone.attrs["noise"])
    assert long.attrs["noise"]["streetlights"] < few.attrs["noise"]["streetlights"]

    groups = [str(g) for g in long.light_group.values]
    assert sky.any() and (seen[groups.index("sky")] == sky).all()  # no lamp
    seen = seen & ~sky
    tile = float(few.x[1] - few.x[0])
    # positions of the lamps: y to the left over x ahead, as tangents
    for group, low, high in (
        ("headlights", -2.6 / 22, -1.2 / 22),
        ("other", 1.2 / 16, 2.6 / 16),
    ):
        x = few.x.values[seen[groups.index(group)].any(axis=0)]
        assert 0 < len(x) < 8 and x.min() > low - tile and x.max() < high + tile

    truth = tristimulus(long)[:, 1]
    before = tristimulus(few)[:, 1]
    after = denoised(few)[:, 1]
    k = groups.index("streetlights")
    errors = [transport.median_error(look[k], truth[k], ~seen[k]) for look in (before, after)]
    assert errors[1] < 0.7 * errors[0]  # denoising is at least as good as twice the paths
    # a factor of 2: the noise is stated to a factor of 1.5, and only half of 1296 tiles of one
    # street count
    assert 0.5 < transport.own_errors(few)["streetlights"] / errors[0] < 2.0
