"""Names that become folders of a store: checked where users type them, and again where they are
written.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..errors import CatalogError, ConfigError

# largest length in UTF-8; file systems allow 255, and temporary names are longer than final ones
LONGEST_BYTES = 100
FORBIDDEN = frozenset('/\\:*?"<>|')  # separators, and characters that Windows refuses
RESERVED = frozenset(  # zarr's own file, and devices of Windows
    ["ZARR.JSON", "CON", "PRN", "AUX", "NUL"]
    + [f"{device}{number}" for device in ("COM", "LPT") for number in range(1, 10)]
)
EXPECTED = "expected letters, digits, '_', '-' and '.', for example front_left"


def check_names(kind: str, names: Iterable[object]) -> None:
    """Refuse names of cameras, versions, flares or metrics that cannot be folders of a store.

    Parameters
    ----------
    kind : kind of the names, for the message.
    names : the names to check.

    Raises
    ------
    ConfigError : a name is empty, too long, reserved, or contains a character that is not allowed
        in a folder.
    """
    for name in names:
        if reason := _problem(str(name)):
            raise ConfigError(f"the {kind} name {_shown(str(name))} {reason}; {EXPECTED}")


def check_path(path: str, single: bool = False) -> None:
    """Refuse a path below a store that leads out of it.

    Parameters
    ----------
    path : names with `/` between them; "" is the store itself.
    single : whether exactly one name is expected.

    Raises
    ------
    CatalogError : a name of the path cannot be a folder of a store.
    """
    for name in [path] if single else path.split("/") if path else []:
        if reason := _problem(name):
            raise CatalogError(
                f"{_shown(path)} cannot be stored: {_shown(name)} {reason}; {EXPECTED}"
            )


def _problem(name: str) -> str:
    if not name:
        return "is empty"
    if set(name) == {"."}:
        return "leads out of its folder"
    wrong = sorted(c for c in set(name) if c in FORBIDDEN or not c.isprintable())
    if wrong:
        return f"holds {', '.join(map(repr, wrong))}"
    if len(name.encode()) > LONGEST_BYTES:
        return f"has {len(name.encode())} bytes; the most are {LONGEST_BYTES}"
    if name[0] == " " or name[-1] in " .":
        return "begins with a space, or ends with a space or a dot"
    if name.startswith("__") or {name.upper(), name.upper().partition(".")[0]} & RESERVED:
        return "is reserved"
    return ""


def _shown(name: str) -> str:
    return repr(name if len(name) <= LONGEST_BYTES else f"{name[:LONGEST_BYTES]}...")
