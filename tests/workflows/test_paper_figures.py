"""The paper's figures on five lights that need no renderer: laws that hold in any scene."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_workflows.paper import fig3, fig5, fig6_7, fig8_9, rendered_scene

from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import chain

SMALL = [
    "experiment=five_lights",
    "scene.width=96",
    "scene.height=54",
    "scene.horizontal_field_deg=8",
    "lens.focal_length_mm=4",
    "~flare.dirt",
]


def five_lights(*overrides):
    """Return the same as `rendered`, for a chart: the chain and the scene radiance."""
    parts = chain(
        compose([*SMALL, *(o for o in overrides if not o.startswith(("experiment", "lighting")))])
    )
    return parts, parts.scene()


@pytest.fixture(autouse=True)
def chart(monkeypatch):
    for module in (fig3, fig5, fig6_7, fig8_9):
        monkeypatch.setattr(module, "rendered", five_lights)


def test_rendered_reads_what_a_chart_knows():
    parts, scene = rendered_scene.rendered(*SMALL)
    assert {"headlights", "sky"} <= set(
        map(str, scene.light_group.values)
    ) and parts.renderer is None


@pytest.mark.parametrize("settings", [{"draws": 0}, {"levels": 0}, {"levels": -1}])
def test_scores_need_a_level_and_a_shot(settings):
    with pytest.raises(ConfigError, match="expected 1 or more of both"):
        fig8_9.paper_fig8_9_classical(**settings)


@pytest.mark.slow
def test_day_lifts_the_dark_and_not_the_headlight(tmp_path):
    night, day = fig3.paper_fig3(picture=str(tmp_path / "a.png"))
    # the lamp's own light is the same in both
    assert day["lux_headlight"] == pytest.approx(night["lux_headlight"], rel=0.2)
    assert (tmp_path / "a.png").stat().st_size > 5000


@pytest.mark.slow
def test_a_longer_exposure_saturates_more(tmp_path):
    rows = fig5.paper_fig5(picture=str(tmp_path / "b.jpg"))
    saturated = [r["saturated_percent"] for r in rows]
    assert saturated == sorted(saturated) and saturated[-1] > saturated[0]
    assert all(np.isnan(r["snr_person"]) for r in rows)  # the scene has no person


@pytest.mark.slow
def test_three_captures_hold_more_than_one(tmp_path):
    rows = {r["capture"]: r for r in fig6_7.paper_fig6_7(picture=str(tmp_path / "c.jpg"))}
    combined = rows.pop("combined")
    assert combined["decades"] > max(r["decades"] for r in rows.values())
    assert combined["saturated_percent"] < rows["large, high gain"]["saturated_percent"]
    with pytest.raises(ConfigError, match="no scene 'tunel'.*tunnel"):
        fig6_7.paper_fig6_7(scene="tunel")


@pytest.mark.slow
def test_light_helps_every_camera():
    rows = fig8_9.paper_fig8_9_classical(levels=2, draws=2)
    for dark, lit in zip(rows[::2], rows[1::2]):
        assert (dark["filters"], dark["demosaic"]) == (lit["filters"], lit["demosaic"])
        assert lit["ciede2000"] < dark["ciede2000"] and lit["ssim"] > dark["ssim"]
