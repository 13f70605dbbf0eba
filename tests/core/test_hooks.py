"""The six hooks are called in order, with the documented arguments."""

from __future__ import annotations

from contextlib import contextmanager

import pluggy
import pytest
import typer
from typer.testing import CliRunner

from isethdr_core import compose, hookimpl, hookspecs, run
from isethdr_core.cli.commands import add_commands
from isethdr_core.errors import IsetHdrError
from isethdr_core.plugins.config_paths import config_paths
from isethdr_core.plugins.registry import components, plugin_manager

# 24 x 16 tiles within 2 degrees: a run takes a tenth of a second
SMALL = [
    "scene=uniform",
    "scene.width=24",
    "scene.height=16",
    "scene.horizontal_field_deg=2",
    "~renderer",
    "lighting=ideal",
    "~versions",
    "lens=ideal",
    "~flare.dirt",
    "isp=linear",
    "draws=1",
    "+metric@metric.mean=ideal",
    *(
        f"~metric.{name}"
        for name in (
            "shares",
            "dynamic_range",
            "snr",
            "colour",
            "ssim",
            "log_luminance",
            "contrast",
            "detection",
        )
    ),
]


class Recorder:
    """A plugin that records which hook was called for which stage."""

    def __init__(self):
        self.calls = []
        self.stages = []

    @hookimpl
    def isethdr_before_stage(self, stage):
        assert stage.component is not None and stage.result is None and stage.error is None
        self.calls.append(("before", stage.kind, stage.name))

    @hookimpl
    def isethdr_after_stage(self, stage):
        assert stage.result is not None and stage.error is None
        self.stages.append(stage)
        self.calls.append(("after", stage.kind, stage.name))

    @hookimpl
    def isethdr_on_stage_error(self, stage):
        assert isinstance(stage.error, BaseException) and stage.result is None
        self.calls.append(("error", stage.kind, stage.name))


@contextmanager
def plugged_in(plugin):
    plugin_manager().register(plugin, name="recorder")
    try:
        yield plugin
    finally:
        plugin_manager().unregister(name="recorder")


def test_isethdr_before_stage_and_isethdr_after_stage_surround_every_stage():
    with plugged_in(Recorder()) as seen:
        result = run(compose([*SMALL, "sensor=bayer"]))
    chain = [
        ("scene", "uniform"),
        ("lighting", "ideal"),
        ("lens", "ideal"),
        ("sensor", "bayer"),
        ("isp", "bayer"),
        ("metric", "mean bayer"),
    ]
    assert seen.calls == [(when, *stage) for stage in chain for when in ("before", "after")] + [
        ("after", "run", result.key)
    ]
    assert [s.row.stage for s in seen.stages[:-1]] == [f"{kind} {name}" for kind, name in chain]
    assert {row.stage for row in result.ledger} >= {f"{kind} {name}" for kind, name in chain}


def test_a_stored_run_calls_no_stage():
    run(compose([*SMALL, "sensor=bayer"]))
    with plugged_in(Recorder()) as seen:
        assert not run(compose([*SMALL, "sensor=bayer"])).computed
    assert [call[:2] for call in seen.calls] == [("after", "run")], (
        "only the whole run is announced, so that a missing report is made"
    )


def test_isethdr_on_stage_error_is_called_and_the_error_goes_on(monkeypatch):
    def broken(*_, **__):
        raise ArithmeticError("glass broke")

    for way in ("__call__", "photocurrent", "plan"):
        monkeypatch.setattr(components()["lens", "ideal"].cls, way, broken)
    with plugged_in(Recorder()) as seen, pytest.raises(ArithmeticError, match="glass broke"):
        run(compose([*SMALL, "sensor=bayer"]))
    assert seen.calls[-3:-1] == [("before", "lens", "ideal"), ("error", "lens", "ideal")]
    assert seen.calls[-1][:2] == ("error", "run")


def test_a_stage_may_be_given_more_attributes_later():
    """A hook passes one object, so that a new attribute breaks no plugin."""

    class Old:
        @hookimpl
        def isethdr_before_stage(self, stage):
            assert {"kind", "name", "component"} <= set(vars(stage))

        @hookimpl
        def isethdr_after_stage(self):  # pluggy lets a plugin leave arguments out
            pass

    with plugged_in(Old()):
        run(compose([*SMALL, "sensor=bayer"]))


def test_isethdr_commands_adds_to_the_command_line():
    class Shouter:
        @hookimpl
        def isethdr_commands(self, app):
            @app.command("shout")
            def shout(text: str):
                typer.echo(text.upper())

            @app.command("whisper")
            def whisper(text: str):
                typer.echo(text.lower())

    app = typer.Typer()
    with plugged_in(Shouter()) as plugin:
        plugin_manager().subset_hook_caller(
            "isethdr_commands", [p for p in plugin_manager().get_plugins() if p is not plugin]
        )(app=app)
    result = CliRunner().invoke(app, ["shout", "hello"])
    assert result.exit_code == 0 and "HELLO" in result.output


def test_isethdr_components_and_isethdr_config_paths_feed_the_registry():
    hook = plugin_manager().hook
    offered = [c for impl in hook.isethdr_components.get_hookimpls() for c in impl.function()]
    assert {(c.kind, c.name) for c in offered} >= {("lens", "ideal"), ("sensor", "bayer")}
    paths = [p for impl in hook.isethdr_config_paths.get_hookimpls() for p in impl.function()]
    assert "pkg://isethdr_sensors.conf" in paths
    assert all(p.startswith("pkg://") for p in paths)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (["pkg://acme_camra.conf"], "acme_camra"),
        (["pkg://acme_camra"], "no package 'acme_camra'"),
        ("pkg://isethdr_sensors.conf", "expected a list"),
        (None, "TypeError"),
        ([3], "returned 3 in its list"),
    ],
)
def test_a_plugin_that_names_no_folder_hides_no_preset_of_the_others(answer, said, caplog):
    class Mistaken:
        @hookimpl
        def isethdr_config_paths(self):
            return answer

    every = list(config_paths())
    with plugged_in(Mistaken()):
        assert list(config_paths()) == every
        assert compose([*SMALL, "sensor=typical_bayer"]).sensor
        assert list(config_paths()) == every
    [message] = [text for text in caplog.messages if "names no folders with presets" in text]
    assert said in message


def test_a_hook_that_raises_stops_the_run_and_stores_nothing(isethdr_home):
    class Strict:
        @hookimpl
        def isethdr_before_stage(self, stage):
            if stage.kind == "isp":
                raise IsetHdrError("not today")

    with plugged_in(Strict()), pytest.raises(IsetHdrError, match="not today"):
        run(compose([*SMALL, "sensor=bayer"]))
    assert (
        not list((isethdr_home / "runs").glob("*"))
        and len(list((isethdr_home / "failed").glob("*.txt"))) == 1
    )


@pytest.mark.parametrize("when", ["before", "after"])
def test_an_error_of_a_hook_names_its_plugin_and_the_stage(when):
    class Buggy:
        def fail(self, stage):
            if stage.kind == "isp":
                raise ValueError("no such file")

        if when == "before":

            @hookimpl
            def isethdr_before_stage(self, stage):
                self.fail(stage)
        else:

            @hookimpl
            def isethdr_after_stage(self, stage):
                self.fail(stage)

    with plugged_in(Buggy()), pytest.raises(ValueError, match="no such file") as told:
        run(compose([*SMALL, "sensor=bayer"]))
    note = f"in isethdr_{when}_stage of plugin 'recorder', at stage isp bayer"
    assert told.value.__notes__.count(note) == 1


def test_commands_of_a_broken_plugin_are_left_out_and_the_others_work(caplog):
    class Broken:
        @hookimpl
        def isethdr_commands(self, app):
            raise RuntimeError("no licence")

    manager = pluggy.PluginManager("isethdr")
    manager.add_hookspecs(hookspecs)
    others = [plugin_manager().get_plugin(name) for name in ("optics", "scenes")]
    for plugin in (others[0], Broken(), others[1]):
        manager.register(plugin, name="acme" if isinstance(plugin, Broken) else None)
    apps = [typer.Typer(), typer.Typer()]
    add_commands(manager, apps[0])
    assert ["'acme' cannot add its commands" in text for text in caplog.messages] == [True]
    manager.unregister(name="acme")
    manager.hook.isethdr_commands(app=apps[1])
    commands = [
        [(c.name, c.callback) for c in app.registered_commands]
        + [group.name for group in app.registered_groups]
        for app in apps
    ]
    assert commands[0] == commands[1] and commands[0]
