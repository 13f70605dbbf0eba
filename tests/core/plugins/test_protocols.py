"""Contracts of components: the abilities of each kind, and the refusals at loading."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, make_dataclass
from functools import cached_property

import pytest

import isethdr_core
from isethdr_core.component import KINDS
from isethdr_core.errors import PluginError
from isethdr_core.plugins import abilities, protocols
from isethdr_core.plugins.protocols import by_kind
from isethdr_core.plugins.registry import components

from ..command_line import isethdr, write_plugin

# (kind, Protocol, method) of every optional method
OFFERED = [
    (kind, protocol, name)
    for kind in KINDS
    for protocol in by_kind.abilities_of(kind)
    for name in abilities.methods(protocol)
    if name != abilities.CALL
]


def name_of(case) -> str:
    return case.__name__ if isinstance(case, type) else str(case)


def body(*parameters: str):
    """Return a method with parameters of these names."""
    scope: dict = {}
    exec(f"def method(self, {', '.join(parameters)}): return None", scope)  # noqa: S102 - a toy
    return scope["method"]


def component(kind: str, **members) -> type:
    """Return a class that has the call that its kind requires, and these members."""
    for protocol in by_kind.required_of(kind):
        for name in abilities.methods(protocol):
            members.setdefault(name, right(protocol, name))
    return make_dataclass("Toy", [], namespace=members, frozen=True)


def right(protocol: type, name: str):
    """Return a method with a Protocol's parameters; positional-only ones get other names."""
    parameters = abilities.methods(protocol)[name].parameters.values()
    named = [f"_{k}" if p.kind is p.POSITIONAL_ONLY else p.name for k, p in enumerate(parameters)]
    optional = ["" if p.default is p.empty else "=None" for p in parameters]
    return body(*map(str.__add__, named, optional))


def called(protocol: type) -> dict:
    """Return the member `__call__` if an ability declares a call of its own, else no member."""
    own = abilities.CALL in abilities.methods(protocol)
    return {abilities.CALL: right(protocol, abilities.CALL)} if own else {}


def misspelt(name: str) -> list[str]:
    """Return a name without one of its letters, with one too many, and with two of them swapped."""
    middle = len(name) // 2
    wrong = [name[:middle] + name[middle + 1 :], f"{name}s"]
    if len(name) >= 5 and name[1] != name[2]:  # in a shorter name, swapped letters are another word
        wrong.append(name[0] + name[2] + name[1] + name[3:])
    return wrong


@pytest.mark.parametrize(("kind", "protocol", "name"), OFFERED, ids=name_of)
def test_a_method_as_the_protocol_says_is_an_ability(kind, protocol, name):
    members = {
        n: right(protocol, n)
        for n in abilities.methods(protocol)
        if n not in (abilities.CALL, name)
    }
    members |= dict.fromkeys(abilities.fields(protocol))
    offered = component(kind, **members, **called(protocol), **{name: right(protocol, name)})
    abilities.check(kind, "toy", offered)
    assert isinstance(offered(), protocol)
    assert not isinstance(component(kind, **members)(), protocol)


@pytest.mark.parametrize(("kind", "protocol", "name"), OFFERED, ids=name_of)
def test_a_misspelt_method_is_refused_with_the_right_name(kind, protocol, name):
    for wrong in [*misspelt(name), name.upper()]:
        offered = component(kind, **{wrong: right(protocol, name)})
        with pytest.raises(PluginError, match=re.escape(f"{wrong!r}; did you mean {name}(")):
            abilities.check(kind, "toy", offered)


@pytest.mark.parametrize(("kind", "protocol", "name"), OFFERED, ids=name_of)
def test_a_method_with_other_parameters_is_refused_with_the_right_ones(kind, protocol, name):
    count = len(abilities.methods(protocol)[name].parameters)
    wrong = [body(*(f"_{k}" for k in range(count + 1)))]
    wrong += [body(*(f"_{k}" for k in range(count - 1)))] if count else []
    for method in wrong:
        with pytest.raises(PluginError) as caught:
            abilities.check(kind, "toy", component(kind, **called(protocol), **{name: method}))
        said = str(caught.value)
        assert f"cannot be called as {abilities.written(name, protocol)}" in said, said
        assert protocol.__name__ in said


@pytest.mark.parametrize("name", ["WITHIN_FEILD", "WITHIN_FIELDS", "within_field", "Within_Fields"])
def test_a_misspelt_class_attribute_is_refused(name):
    with pytest.raises(PluginError, match=f"{name}'; did you mean WITHIN_FIELD"):
        abilities.check("lighting", "toy", component("lighting", **{name: True}))


@pytest.mark.parametrize("kind", sorted(by_kind.REQUIRED))
def test_a_component_that_cannot_be_called_is_refused(kind):
    [protocol] = by_kind.required_of(kind)
    for members in ({}, {"__call__": body(*"abcdef")}):
        offered = make_dataclass("Toy", [], namespace=members, frozen=True)
        with pytest.raises(PluginError, match=re.escape(abilities.written("__call__", protocol))):
            abilities.check(kind, "toy", offered)


def test_a_renderer_that_goes_on_is_called_with_what_is_known():
    methods = {"enough": body("paths", "noise"), "__call__": body("description", "demand")}
    with pytest.raises(PluginError, match="known.*AccumulatesSamples.*too many positional"):
        abilities.check("renderer", "toy", component("renderer", **methods))
    methods["__call__"] = body("description", "demand", "known")  # `known` needs no default
    abilities.check("renderer", "toy", component("renderer", **methods))


def test_what_is_no_method_is_refused_in_its_place():
    for value, said in (
        (property(lambda self: (550.0,)), "is a property"),
        (cached_property(lambda self: (550.0,)), "is a property"),
        ((550.0,), r"is \(550.0,\)"),
    ):
        with pytest.raises(PluginError, match=f"'bands_nm' {said}; expected the method bands_nm"):
            abilities.check("scene", "toy", component("scene", bands_nm=value))

    @dataclass(frozen=True)
    class Field:
        """A scene with a field that has the name of an ability."""

        bands_nm: tuple[float, ...] = ()

        def __call__(self):
            return None

    with pytest.raises(PluginError, match="'bands_nm' is a field; expected the method"):
        abilities.check("scene", "toy", Field)


def test_methods_of_other_forms_are_checked_alike():
    class Forms:
        """Not a component: holds methods."""

        @staticmethod
        def narrow(demand):
            return demand

        @classmethod
        def input_files(cls):
            return ()

    forms = vars(Forms)
    abilities.check(
        "isp", "toy", component("isp", narrow=forms["narrow"], input_files=forms["input_files"])
    )
    with pytest.raises(PluginError, match="cannot be called as input_files"):
        abilities.check("isp", "toy", component("isp", input_files=forms["narrow"]))
    with pytest.raises(PluginError, match="cannot be called as narrow"):
        abilities.check("isp", "toy", component("isp", narrow=forms["input_files"]))


def test_an_ability_that_is_withdrawn_is_not_there():
    base = component("lens", keeps_light=body("flares"))
    less = type("Less", (base,), {"keeps_light": None, "__doc__": "Another lens."})
    abilities.check("lens", "toy", less)
    assert isinstance(base(), protocols.KeepsLight)
    assert not isinstance(less(), protocols.KeepsLight)


def test_methods_of_a_plugins_own_are_let_alone():
    own = {
        "kernel": body("wavelength_nm"),  # nearly `kernels`, which is called without arguments
        "check_files": body("folder"),  # an ability of scenes, and not far from `check_field`
        "check_bend": body("width_m", "height_m"),
        "_narow": body("demand"),
        "pupils": body("x_mm", "y_mm", "wavelength_nm"),  # nearly an ability of flares
    }
    for kind in ("sensor", "lens", "renderer"):
        abilities.check(kind, "toy", component(kind, **own))
    both = {"pupil": own["pupils"], "pupils": own["pupils"]}
    abilities.check("flare", "toy", component("flare", **both))


def test_effort_names_fields():
    @dataclass(frozen=True)
    class Tracer:
        """A renderer."""

        samples: int = 4
        effort_fields = ("sample",)

        def __call__(self, description, demand):
            return None

    with pytest.raises(PluginError, match="names 'sample', which is no field; did you mean 'samp"):
        abilities.check("renderer", "toy", Tracer)


@pytest.mark.parametrize("kind", KINDS)
def test_names_of_one_kind_are_not_taken_for_each_other(kind):
    known = sorted(abilities.names(kind))
    near = [(a, b) for a in known for b in known if a != b and abilities._nearest(a, (b,))]
    assert not near


def test_every_ability_is_offered_by_a_bundled_component():
    made = {kind: [] for kind in KINDS}
    for (kind, _), offered in components().items():
        if offered.cls.__module__.startswith("isethdr_"):
            made[kind].append(offered.cls())
    for kind in KINDS:
        for protocol in by_kind.abilities_of(kind):
            if protocol not in (*by_kind.OF_ANY_KIND, *by_kind.EARLIER):
                assert any(isinstance(c, protocol) for c in made[kind]), f"{kind}: {protocol}"
    everything = [c for some in made.values() for c in some]
    for protocol in by_kind.OF_ANY_KIND:
        assert any(isinstance(c, protocol) for c in everything), protocol


@pytest.mark.parametrize("kind", sorted(by_kind.REQUIRED))
def test_bundled_components_follow_the_protocol_of_their_kind(kind):
    [protocol] = by_kind.required_of(kind)
    for (its_kind, name), offered in components().items():
        if its_kind == kind:
            assert isinstance(offered.cls(), protocol), name


def test_every_protocol_is_documented():
    for protocol in {p for kind in KINDS for p in by_kind.abilities_of(kind)}:
        assert inspect.getdoc(protocol), protocol
        for name in abilities.methods(protocol):
            assert inspect.getdoc(getattr(protocol, name)), f"{protocol.__name__}.{name}"


LENS = '''
from dataclasses import dataclass
from isethdr_core import Component, hookimpl
{head}

@dataclass(frozen=True)
class Acme:
    """A lens of Acme."""

    def __call__(self, mixed, flares=()):
        return mixed

    def {method}:
        return True

@hookimpl
def isethdr_components():
    return [Component("lens", "{name}", {offered})]
'''


NEWER = isethdr_core.PLUGIN_API + 1
KEEPS = "keeps_light(self, flares)"
FAULTS = {  # package: (text above the class, its method, expected message)
    "acme_misspelt": ("", "keep_light(self, flares)", "did you mean keeps_light("),
    "acme_signed": ("", "keeps_light(self)", "cannot be called as keeps_light("),
    "acme_newer": (f"ISETHDR_PLUGIN_API = {NEWER}", KEEPS, "it needs plugin API"),
    "acme_newer_import": (
        f"from isethdr_core import something_new\nISETHDR_PLUGIN_API = {NEWER}",
        KEEPS,
        "it needs plugin API",
    ),
    "acme_no_number": ("ISETHDR_PLUGIN_API = '2'", KEEPS, "expected a whole number"),
    "acme_current": (f"ISETHDR_PLUGIN_API = {isethdr_core.PLUGIN_API}", KEEPS, ""),
}


@pytest.fixture(scope="module")
def listed(tmp_path_factory):
    """Return the finished `isethdr plugins lens`, with all packages of `FAULTS` installed."""
    folder = tmp_path_factory.mktemp("site")
    for package, (head, method, _) in FAULTS.items():
        source = LENS.format(name=package, head=head, method=method, offered="Acme")
        write_plugin(folder, package, source)
    packages = ",".join(["core", "optics", *FAULTS])
    home = str(tmp_path_factory.mktemp("home"))
    return isethdr("plugins", "lens", plugins=[folder], ISETHDR_PLUGINS=packages, ISETHDR_HOME=home)


@pytest.mark.parametrize("package", FAULTS)
def test_a_plugin_with_such_a_fault_is_one_line_and_the_others_go_on(listed, package):
    said = FAULTS[package][2]
    assert listed.returncode == 0 and "diffraction_limited" in listed.stdout
    lines = [line for line in listed.stderr.splitlines() if re.search(rf"\b{package}\b", line)]
    if not said:
        assert f"A lens of Acme. ({package})" in listed.stdout and not lines
        return
    assert f"{package}  A lens of Acme" not in listed.stdout
    [line] = lines
    assert "skipped" in line and said in line


def test_faults_are_one_line_each(listed):
    assert len([line for line in listed.stderr.splitlines() if line]) == len(FAULTS) - 1


COMMANDS = """
import contextlib, sys
from isethdr_core.cli.commands import main
sys.stderr = sys.stdout
for arguments in (["--help"], ["plugins", "lens"], ["plan", "lens=acme"]):
    print("NEXT" * (arguments != ["--help"]))
    sys.argv = ["isethdr", *arguments]
    with contextlib.suppress(SystemExit):
        main()
"""


@pytest.mark.slow
def test_a_class_that_is_loaded_on_first_use_is_checked_then(tmp_path):
    source = LENS.format(
        name="acme", head="", method="keep_light(self, flares)", offered='"acme:Acme"'
    )
    folder = write_plugin(tmp_path, "acme", source)
    shown = isethdr(code=COMMANDS, plugins=[folder])
    of_help, *of_others = shown.stdout.split("NEXT\n")
    assert len(of_others) == 2 and "Acme" not in of_help and "did you mean" not in of_help
    for said in of_others:
        assert "did you mean keeps_light(" in said
    assert "Traceback" not in shown.stdout + shown.stderr
