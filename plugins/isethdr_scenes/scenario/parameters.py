"""Parameters of a scenario: replace `$name` and arithmetic such as `${$start + 30}` by values."""

from __future__ import annotations

import ast
import operator
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping

NAME = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def declared(element: ET.Element, given: Mapping[str, str]) -> dict[str, str]:
    """Return the parameters that an element declares, by name, in their order.

    Parameters
    ----------
    element : element with declarations. A value may use the parameters that are declared before it.
    given : values that replace those of the declarations, by name.
    """
    values: dict[str, str] = {}
    for node in element.findall("ParameterDeclarations/ParameterDeclaration"):
        name = node.get("name", "")
        values[name] = given.get(name, _worked_out(node.get("value", ""), values))
    return values


def assigned(element: ET.Element) -> dict[str, str]:
    """Return the parameters that a CatalogReference assigns, by name."""
    return {
        node.get("parameterRef", "").lstrip("$"): node.get("value", "")
        for node in element.findall("ParameterAssignments/ParameterAssignment")
    }


def put_values(element: ET.Element, values: Mapping[str, str]) -> None:
    """Replace the parameters in the attributes of an element and of all elements below it.

    A text that cannot be evaluated stays as it is; reading it as a number then raises an error.
    """
    for node in element.iter():
        for key, text in node.attrib.items():
            if "$" in text:
                node.set(key, _worked_out(text, values))


def _worked_out(text: str, values: Mapping[str, str]) -> str:
    if text[:1] == "$" and text[1:] in values:
        return values[text[1:]]
    if not (text.startswith("${") and text.endswith("}")):
        return text
    told = NAME.sub(lambda found: f"({values.get(found[1], found[1])})", text[2:-1])
    try:
        value = _number(ast.parse(told.strip(), mode="eval").body)
        return str(int(value)) if value.is_integer() else repr(value)  # ids are whole numbers
    except (SyntaxError, ValueError, ZeroDivisionError):
        return text


def _number(node: ast.expr) -> float:
    """Return the value of sums, differences, products and quotients of numbers."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return float(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_number(node.operand)
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
        return OPERATIONS[type(node.op)](_number(node.left), _number(node.right))
    raise ValueError(ast.dump(node))
