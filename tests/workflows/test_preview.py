"""The study `preview`: a picture and one row per light group, with the weights of the experiment;
mistakes are reported.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from isethdr_workflows import preview as module
from omegaconf import OmegaConf

from isethdr_core import build
from isethdr_core.data import quantities
from isethdr_core.display.preview import tristimulus
from isethdr_core.errors import ConfigError

SHAPE = (18, 32)
GROUPS = ("sky", "lamps")


def rendering(labels):
    """Return a noisy uniform scene of two light groups, as a renderer gives it."""
    light = 1 + 0.3 * np.random.default_rng(0).standard_normal((2, 1, *SHAPE)).clip(-2, 2)
    light = np.broadcast_to(light * np.reshape([1.0, 0.1], (2, 1, 1, 1)), (2, 3, *SHAPE))
    y, x = (quantities.centres(n, 0.01 * n) for n in SHAPE)
    scene = quantities.scene_radiance(
        light, GROUPS, [450.0, 550.0, 650.0], x, y, instance=np.ones(SHAPE, np.uint32)
    )
    scene["xyz_noise"] = ("light_group", "xyz_channel", "y", "x"), 0.3 * tristimulus(scene)
    scene.attrs["noise"] = dict.fromkeys(GROUPS, 0.3)
    assert labels == module.LABELS
    return scene


@pytest.fixture
def chain(monkeypatch):
    asked = []
    parts = SimpleNamespace(
        scene=lambda: None,
        renderer=lambda description, demand: rendering(demand.labels),
        lighting=build("lighting", "weights", weights={"sky": 1e-3, "lamps": 2.0}),
    )
    fields = {"name": "fast", "samples": 1, "width": 1, "height": 1}

    def compose(overrides):
        asked.extend(overrides)
        return OmegaConf.create({"renderer": fields})

    monkeypatch.setattr("isethdr_workflows.preview.compose", compose)
    monkeypatch.setattr("isethdr_workflows.preview.chain", lambda config: parts)
    return asked


def test_a_picture_and_a_row_per_group(chain, tmp_path):
    from PIL import Image

    rows = module.preview(samples=8, width=32, picture=str(tmp_path / "look.png"))
    assert {"renderer.samples=8", "renderer.width=32", "renderer.height=18"} <= set(chain)
    assert {r["light_group"]: r["weight"] for r in rows} == {"sky": 1e-3, "lamps": 2.0}
    # denoising changes a tile by about its noise; half of the changes are below 0.67 x 0.3
    assert all(0.05 < r["moved"] < 0.5 and r["noise"] == 0.3 for r in rows)
    # 3 %: the mean of 576 tiles with 30 % noise is known to 1.3 %
    assert all(abs(r["light_kept"] - 1) < 0.03 for r in rows)
    clean = np.asarray(Image.open(tmp_path / "look.png"), float)
    plain_rows = module.preview(denoise=0, picture=str(tmp_path / "noisy.png"))
    assert [r["moved"] for r in plain_rows] == [0.0, 0.0]
    assert len(module.preview(denoise=0, picture="")) == 2  # no file
    noisy = np.asarray(Image.open(tmp_path / "noisy.png"), float)
    assert clean.shape == (*SHAPE, 3) and clean[..., 1].std() < noisy[..., 1].std() / 2


def test_denoise_is_on_or_off(tmp_path):
    with pytest.raises(ConfigError, match="denoise is 2; expected 1, or 0.*type denoise=1"):
        module.preview(denoise=2, picture=str(tmp_path / "no.png"))
    assert not list(tmp_path.iterdir())


def test_a_chart_is_refused_because_it_is_not_rendered(tmp_path):
    with pytest.raises(ConfigError, match="states its own radiance.*type .*scene=night_drive"):
        module.preview("scene=macbeth", picture=str(tmp_path / "p.png"))


@pytest.mark.parametrize("field", ["samples", "width"])
def test_a_preview_without_samples_or_tiles_is_refused(field, tmp_path):
    with pytest.raises(ConfigError, match=f"{field} is 0; expected 1 or more"):
        module.preview(**{field: 0}, picture=str(tmp_path / "p.png"))


def test_a_renderer_without_samples_and_height_is_refused_with_advice(monkeypatch):
    config = OmegaConf.create({"renderer": {"name": "own", "width": 32}})
    monkeypatch.setattr("isethdr_workflows.preview.compose", lambda overrides: config)
    expected = "renderer 'own' has no field 'samples' and 'height'.*type renderer=mitsuba"
    with pytest.raises(ConfigError, match=expected):
        module.preview(picture="")
