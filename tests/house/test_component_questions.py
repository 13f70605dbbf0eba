"""Abilities of a component are tested by type, `isinstance(lens, KeepsLight)`, never by
`hasattr`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .source import PRODUCT, name_of, tree

LOADING = "a plugin is looked over when it is loaded"
DATA = "data, not a component: anything may be passed here"
ERROR = "an exception of another library, of which some have it"
LIBRARY = "another library, or what it read from a file"
MODULE = "a module, or the syntax tree of one"
# {file: {call as Python writes it: why it may stay}}
MAY_STAY = {
    "isethdr_core/config/composition.py": {"getattr(owner, '__name__', '')": ERROR},
    "isethdr_core/config/hydra_app.py": {"getattr(err, '__notes__', [])": ERROR},
    "isethdr_core/data/reference_picture.py": {"getattr(picture, 'data_vars', {})": DATA},
    "isethdr_core/data/temporal_modulation.py": {"getattr(light, 'dims', ())": DATA},
    "isethdr_core/display/display_view.py": {"hasattr(picture, 'data_vars')": DATA},
    "isethdr_core/identity/name_bindings.py": {
        "getattr(node, key, None)": MODULE,
        "getattr(statement, 'value', None)": MODULE,
    },
    "isethdr_core/identity/normal_form.py": {"getattr(node, name, None)": MODULE},
    "isethdr_core/identity/package_sources.py": {
        "getattr(sys.modules.get(module), '__file__', None)": MODULE
    },
    "isethdr_core/plugins/registry.py": {
        "getattr(plugin, '__name__', type(plugin).__module__)": LOADING,
        "getattr(plugin, API_ASKED, 1)": LOADING,
        "hasattr(getattr(plugin, attribute), 'isethdr_impl')": LOADING,
    },
    "plugins/isethdr_optics/imaging/array_backend.py": {"hasattr(xp, 'Device')": LIBRARY},
    "plugins/isethdr_scenes/iset_exr_files.py": {
        "getattr(content.get('sceneMeta'), 'depthMap', None)": LIBRARY
    },
}


def questions(node: ast.AST) -> Iterator[str]:
    """Yield the calls that ask whether an object has something, as Python writes them.

    `getattr(object, name)` with a variable as name is not among them: it reads a field that must
    exist, and fails if there is none.
    """
    for call in ast.walk(node):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name):
            asked = call.func.id == "getattr" and (
                len(call.args) > 2 or isinstance(call.args[1], ast.Constant)
            )
            if asked or call.func.id == "hasattr":
                yield ast.unparse(call)


def found() -> dict[str, set[str]]:
    """Return {file: the calls that `questions` yields for it}."""
    asking = [file for file in PRODUCT if "attr(" in file.read_text()]
    every = {name_of(file): set(questions(tree(file))) for file in asking}
    return {name: calls for name, calls in every.items() if calls}


def test_nobody_asks_a_component_for_its_attributes():
    wrong = [
        f"{name}: {call}"
        for name, calls in found().items()
        for call in sorted(calls - MAY_STAY.get(name, {}).keys())
    ]
    assert not wrong, (
        "ask isinstance with a Protocol of isethdr_core.plugins.protocols, or say in MAY_STAY why"
        " not:\n" + "\n".join(wrong)
    )


def test_the_list_is_not_out_of_date():
    calls = found()
    gone = [
        f"{name}: {call}"
        for name, may_stay in MAY_STAY.items()
        for call in sorted(may_stay.keys() - calls.get(name, set()))
    ]
    assert not gone, "MAY_STAY lists what is not there any more:\n" + "\n".join(gone)


def test_the_rule_finds_questions():
    asked = "hasattr(lens, 'psf'); getattr(lens, 'psf'); getattr(lens, name, None)"
    assert len(list(questions(ast.parse(asked)))) == 3
    assert not list(questions(ast.parse("getattr(lens, name); isinstance(lens, KeepsLight)")))
