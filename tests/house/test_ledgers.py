"""Functions return the terms that a caller may discard; no code opens a ledger only to
discard it.
"""

from __future__ import annotations

import ast
import re

from isethdr_optics.field.retiling import BORDER, DETAIL
from isethdr_optics.flare.ghosts.ghost_flare import PART
from isethdr_optics.psf.error_parts import KERNELS, SPREAD

from .source import PRODUCT, name_of, text_of, tree


def opens_one(call: ast.Call) -> bool:
    """Return whether a call is `stage(Ledger(), ...)`, whose rows nobody can read."""
    called = call.func.attr if isinstance(call.func, ast.Attribute) else None
    called = called or (call.func.id if isinstance(call.func, ast.Name) else "")
    if called != "stage" or not call.args or not isinstance(call.args[0], ast.Call):
        return False
    made = call.args[0].func
    return (made.attr if isinstance(made, ast.Attribute) else getattr(made, "id", "")) == "Ledger"


def test_no_ledger_is_opened_to_keep_a_function_quiet():
    found = [
        f"{name_of(file)}:{node.lineno}"
        for file in PRODUCT
        if not name_of(file).startswith("workflows")  # studies read the row that they open
        if "Ledger(" in text_of(file)
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Call) and opens_one(node)
    ]
    assert not found, f"return the terms with the result instead: {', '.join(found)}"


def test_one_that_is_thrown_away_is_seen():
    silent = ast.parse('with ledger.stage(ledger.Ledger(), "x"): pass').body[0]
    kept = ast.parse('with stage(rows, "x"): pass').body[0]
    assert opens_one(silent.items[0].context_expr) and not opens_one(kept.items[0].context_expr)


def test_the_core_names_no_part_or_key_of_a_lens_or_flare():
    """The core compares parts and keys for equality only. Only the code that reads earlier ledgers
    knows their names.
    """
    words = {*KERNELS, SPREAD, DETAIL, BORDER, PART, "functionals", "ghosts"}
    written = re.compile("|".join(f"[\"']{re.escape(word)}[\"']" for word in words))
    found = [
        f"{name_of(file)}:{node.lineno}: {node.value!r}"
        for file in PRODUCT
        if name_of(file).startswith("isethdr_core") and file.stem != "earlier_terms"
        if written.search(text_of(file))
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Constant) and node.value in words
    ]
    assert not found, "; ".join(found)
