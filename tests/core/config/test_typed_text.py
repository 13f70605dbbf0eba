"""Texts that Hydra would read as numbers, such as dates and digits of hashes, stay as typed."""

from __future__ import annotations

from dataclasses import make_dataclass
from typing import Optional

import pytest

from isethdr_core.config import typed_text
from isethdr_core.config.composition import compose
from isethdr_core.config.sweeps import prepared
from isethdr_core.config.typed_text import with_texts
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import components
from isethdr_core.runs.labels import Labels, labels_of


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("name=2026_11_29", "name='2026_11_29'"),
        ("++name=1234e56", "++name='1234e56'"),
        ("name='1e5'", "name='1e5'"),
        ("name=night", "name=night"),
        ("name=null", "name=null"),
        ("name=a,1e5", "name=a,'1e5'"),
        ("tags=2026_11_30,wet,true,null", "tags=['2026_11_30',wet,'true','null']"),
        ("tags=[1e3, 'a,1e3,b', \"1e3\"]", "tags=['1e3', 'a,1e3,b', \"1e3\"]"),
        ("tags=null", "tags=null"),
        ("tags=[${name},1e3]", "tags=[${name},1e3]"),
        ("device=007", "device=007"),
        ("device=1e5,A", "device='1e5',A"),
        ("device=range(1,3)", "device=range(1,3)"),
        ("scene.store=12e4", "scene.store='12e4'"),
        ("scene.store=12e4,null", "scene.store='12e4',null"),
        ("scene.path=2026_11_29", "scene.path='2026_11_29'"),
        ("scene.width=1_000", "scene.width=1_000"),
        ("lens.f_number=2e0", "lens.f_number=2e0"),
        ("name=1.50 ", "name='1.50'"),
        ("tags=1e5 ", "tags=['1e5' ]"),
        ("name=été", "name=été"),
        ("isp.model=1.50", "isp.model='1.50'"),
        ("isp.model=true,null", "isp.model='true',null"),
        ("scene.assets=[1e3,b]", "scene.assets=['1e3',b]"),
        ("lighting.moves=[1e3]", "lighting.moves=['1e3']"),
        ("cameras.bayer.qe_csv=1e3", "cameras.bayer.qe_csv='1e3'"),
        ("sensor=bayer,rgbw", "sensor=bayer,rgbw"),
        ("--config-dir=2026_11_29", "--config-dir=2026_11_29"),
    ],
)
def test_quotes_are_added_where_a_text_would_become_a_number(typed, expected):
    assert with_texts([typed]) == [expected]
    assert with_texts([expected]) == [expected], "a text with quotes stays"


def test_the_model_of_a_network_is_that_which_was_typed():
    assert compose(["isp=network", "isp.model=1.50"]).isp.model == "1.50"
    assert compose(["name=1e5 ", "tags=1e5 "]).name == "1e5"


def test_a_text_that_hydra_cannot_read_is_named_as_it_was_typed():
    with pytest.raises(ConfigError, match="'name=été' cannot be read"):
        compose(["name=été"])


def test_only_the_class_of_the_chosen_component_is_asked_for_its_types(monkeypatch):
    asked = []
    bayer = components()["sensor", "bayer"].cls
    monkeypatch.setattr(
        typed_text, "class_of", lambda component: asked.append(component.name) or bayer
    )
    assert with_texts(["sensor=bayer", "sensor.full_well_e=5000"]) and not asked
    assert with_texts(["sensor=bayer", "sensor.full_well_e=1e4"]) and asked == ["bayer"]


def test_annotations_that_are_no_texts_themselves_are_read(monkeypatch):
    fields = [("model", Optional[str]), ("gain", Optional[float])]  # noqa: UP045
    own = make_dataclass("Own", fields)
    monkeypatch.setattr(typed_text, "class_of", lambda component: own)
    assert with_texts(["isp=network", "isp.model=1e5", "isp.gain=1e5"])[1:] == [
        "isp.model='1e5'",
        "isp.gain=1e5",
    ]


def test_names_and_tags_of_a_config_are_those_that_were_typed():
    config = compose(["name=2026_11_29", "tags=2026_11_30,1e3", "device=1e5"])
    assert labels_of(config) == Labels("2026_11_29", ("2026_11_30", "1e3"))
    assert config.device == "1e5" and compose(["device=007"]).device == "007"


def test_the_name_of_a_sweep_is_that_which_was_typed(isethdr_home):
    arguments = with_texts(["-m", "name=1e5", "seed=1,2", "tags=1e3,true"])
    ready = prepared(arguments)
    assert ready.sweep.name == "1e5" and "tags=['1e3','true']" in ready.arguments
