"""Public functions and classes have docstrings, and numbers that users type name their unit."""

from __future__ import annotations

import ast
import dataclasses
import re
import typing

import pytest

from isethdr_core.plugins.registry import components

from .source import PRODUCT, name_of, text_of, tree

UNITS = (
    "nm",
    "um",
    "mm",
    "m",
    "m2",
    "mrad",
    "s",
    "e",
    "v",
    "uv",
    "uv_per_e",
    "e_per_s",
    "dn",
    "deg",
    "rad",
    "sr",
    "c",
    "k",
    "db",
    "hz",
    "cd",
    "cd_m2",
    "lux",
    "um_per_mm",
    "per_mm",
    "per_s",
    "kmh",
    "m_s",
    "per_m",
    "per_km",
    "percent",
    "mm2",
    "lines_per_mm",
)
# field: meaning of a number without a unit, or with a unit that the meaning implies
DIMENSIONLESS = {
    "exposure_target": "metered level over full scale",
    "exposure_percentile": "percent of the pixels",
    "exposure_lamp_ratio": "lamp / 95th percentile",
    "auto_gain_max": "multiplier",
    "f_number": "focal length / diameter",
    "transmittance": "share of the light",
    "inner_transmittance": "share of the light",
    "index": "of refraction",
    "fill_factor": "share of the pixel's area",
    "parked_share": "share of the bays",
    "peak_qe": "electrons per photon",
    "analog_gain": "multiplier",
    "dark_spread": "rms / mean",
    "prnu": "rms / mean",
    "design_snr": "signal / noise",
    "nl_means_strength": "assumed / stated standard deviation",
    "ring": "share of the object's size",
    "margin": "share of the field",
    "others": "weight",
    "rounding": "0 straight .. 1 circle",
    "dynamic_range": "ratio",
    "low_percentile": "percent",
    "high_percentile": "percent",
    "darkest_share": "share of the pixels",
    "compression": "of a tone curve",
    "decades": "powers of ten",
    "gap": "share of the spacing",
    "aspect": "width / height",
    "step": "ratio of luminances",
    "contrast_ratio": "bright / dark",
    "error_allowed": "share of the light",
    "speckle_error": "relative",
    "dust_spread": "sigma of a logarithm",
    "optical_crosstalk_power": "exponent",
    "scattered": "share of the light",
    "slope": "of a power law",
    "wavelength_exponent": "of a power law",
    "shoulder_exponent": "of a power law",
}


def public(node, inside=""):
    """Yield (name, node) of every public function, class and method below `node`."""
    for child in node.body:
        if isinstance(child, ast.FunctionDef | ast.ClassDef) and not child.name.startswith("_"):
            yield f"{inside}{child.name}", child
            if isinstance(child, ast.ClassDef):
                yield from public(child, f"{child.name}.")


def is_hook(node) -> bool:
    return any("hook" in ast.dump(d) for d in node.decorator_list)


# start and end of the header of a function or class, in the layout of the formatter
HEADER = re.compile(r"^ *(?:def|class) [a-zA-Z]", re.MULTILINE)
END_OF_HEADER = re.compile(r":[ ]*(?:#.*)?$", re.MULTILINE)
DOCSTRING = re.compile(r'\s*r?"""[^"]')


def may_lack_docstrings(text: str) -> bool:
    """Return whether something public may have no docstring. Most files need no parsing for it."""
    for header in HEADER.finditer(text):
        end = END_OF_HEADER.search(text, header.end())
        if end is None or not DOCSTRING.match(text, end.end()):
            return True
    return False


def undescribed(module: ast.Module) -> list[str]:
    """Return the names of public functions and classes without a docstring.

    Implementations of hooks are left out: the documentation of the hook describes them.
    """
    return [
        name for name, node in public(module) if not ast.get_docstring(node) and not is_hook(node)
    ]


def test_public_functions_and_classes_have_docstrings():
    files = [file for file in PRODUCT if may_lack_docstrings(text_of(file))]
    missing = [f"{name_of(file)}: {name}" for file in files for name in undescribed(tree(file))]
    assert not missing, "no docstring on\n" + "\n".join(missing)


@pytest.mark.parametrize(
    "text",
    [
        "def f(a):\n    return a\n",
        'def f(\n    a: str = ":",\n) -> None:  # short\n    return a\n',
        'class A:\n    """An A."""\n\n    def f(self): ...\n',
        'class A:\n    a = """no docstring"""\n',
        'def f():\n    """Do."""\n\n\ndef g():\n    # why\n\n    return """text"""\n',
        'def f():\n    """"""\n',
    ],
)
def test_what_lacks_a_docstring_is_parsed_and_found(text):
    assert may_lack_docstrings(text)
    assert undescribed(ast.parse(text))


def test_what_is_described_needs_no_parsing():
    text = (
        'class A:\n    r"""An A."""\n\n'
        '    def f(\n        self,\n    ) -> str:\n        """Do."""\n'
    )
    assert not may_lack_docstrings(text) and not undescribed(ast.parse(text))


@pytest.mark.parametrize(("kind", "name"), sorted(components()), ids=lambda part: part)
def test_the_first_line_of_a_component_says_what_it_is(kind, name):
    text = components()[kind, name].cls.__doc__ or ""
    first = " ".join(text.strip().split("\n\n")[0].split())
    assert 10 <= len(first) <= 200 and first.endswith((".", ";", ":")), f"{kind}/{name}: {first!r}"
    assert not text.startswith(f"{components()[kind, name].cls.__name__}("), (
        f"{kind}/{name} has only the docstring that dataclass makes"
    )


@pytest.mark.parametrize(("kind", "name"), sorted(components()), ids=lambda part: part)
def test_numbers_that_users_type_carry_their_unit(kind, name):
    cls = components()[kind, name].cls
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        if hints[field.name] is float and field.name not in DIMENSIONLESS:
            assert any(field.name.endswith(f"_{unit}") for unit in UNITS), (
                f"{kind}/{name}: {field.name} names no unit; end it with one ({field.name}_m, ...)"
                " or list it in DIMENSIONLESS with what it is"
            )


def test_the_list_of_dimensionless_fields_is_not_out_of_date():
    used = {f.name for c in components().values() for f in dataclasses.fields(c.cls)}
    assert DIMENSIONLESS.keys() <= used, sorted(DIMENSIONLESS.keys() - used)
