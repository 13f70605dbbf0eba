"""Elements of an XML file: attributes as numbers, errors that name the file and the place in it."""

from __future__ import annotations

import gzip
import math
import xml.etree.ElementTree as ET
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from isethdr_core.errors import CatalogError

GZIP = b"\x1f\x8b"  # first bytes of packed files, such as town.net.xml.gz
MOST_PLACES = 3  # greatest number of places that a note names
# bounds of numbers, without sign. Beyond them a road is damaged, and its samples fill the memory.
MOST_M = 1e6  # lengths and places along a road
MOST_PLACE_M = 1e8  # x and y; the coordinates of map projections are below
MOST_COEFFICIENT = 1e8  # coefficients of polynomials


@dataclass
class Notes:
    """Contents of a file that are changed or left out, each with its places."""

    places: dict[str, list[str]] = field(default_factory=dict)

    def add(self, what: str, where: str) -> None:
        """Add a note at a place; the same note at several places is listed once."""
        self.places.setdefault(what, []).append(where)

    @property
    def lines(self) -> tuple[str, ...]:
        """Return one line per note: the note, how often it occurs, and its first places."""
        found = []
        for what, places in self.places.items():
            first = list(Counter(places))[:MOST_PLACES]
            more = ", ..." if len(set(places)) > MOST_PLACES else ""
            times = "once" if len(places) == 1 else f"{len(places)} times"
            found.append(f"{what}: {times} ({'; '.join(first)}{more})")
        return tuple(found)


@dataclass(frozen=True)
class Node:
    """An element of a file, and its place in words."""

    element: ET.Element
    file: Path
    where: str
    notes: Notes

    def error(self, message: str) -> CatalogError:
        """Return the error of this element."""
        return CatalogError(f"{self.file}, {self.where}: {message}")

    def note(self, what: str) -> None:
        """Note a content of the file that is changed or left out."""
        self.notes.add(what, self.where)

    def named(self, where: str) -> Node:
        """Return the same element with other words for its place."""
        return Node(self.element, self.file, where, self.notes)

    def all(self, path: str) -> Iterator[Node]:
        """Return the elements at a path below this one."""
        for element in self.element.findall(path):
            yield Node(element, self.file, self.where, self.notes)

    def first(self, path: str) -> Node | None:
        """Return the first element at a path, or None."""
        return next(self.all(path), None)

    def text(self, name: str, default: str | None = None) -> str:
        """Return an attribute.

        Raises
        ------
        CatalogError : the attribute is missing, and there is no default.
        """
        value = self.element.get(name, default)
        if value is None:
            raise self.error(f"<{self.element.tag}> has no attribute {name!r}; expected one")
        return value

    def number(self, name: str, default: float | None = None, *, most: float = math.inf) -> float:
        """Return an attribute as a finite number.

        Parameters
        ----------
        name : name of the attribute.
        default : its value where it is missing; None: it must not be missing.
        most : greatest value without its sign.

        Raises
        ------
        CatalogError : the attribute is missing without a default, is no finite number, or is beyond
            `most`.
        """
        if default is not None and name not in self.element.attrib:
            return default
        text = self.text(name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(
                f"{name!r} of <{self.element.tag}> is {text!r}; expected a finite number"
            )
        if abs(value) > most:
            raise self.error(
                f"{name!r} of <{self.element.tag}> is {text!r}; expected a number from"
                f" {-most:g} to {most:g}"
            )
        return value

    def numbers(self, *names: str, most: float = math.inf) -> tuple[float, ...]:
        """Return attributes as numbers from -`most` to `most`. A missing attribute is 0."""
        return tuple(self.number(name, 0.0, most=most) for name in names)

    def integer(self, name: str) -> int:
        """Return an attribute as a whole number.

        Raises
        ------
        CatalogError : the attribute is missing, or is no whole number.
        """
        text = self.text(name)
        try:
            return int(text)
        except ValueError:
            raise self.error(
                f"{name!r} of <{self.element.tag}> is {text!r}; expected a whole number"
            ) from None


def opened(file: Path, root: str, kind: str) -> Node:
    """Return the root element of an XML file, which may be packed by gzip, without namespaces.

    Parameters
    ----------
    file : path of the file.
    root : name that the root element must have.
    kind : expected kind of file, for messages.

    Raises
    ------
    CatalogError : the file is missing, no XML, or another kind of file.
    """
    try:
        top = ET.fromstring(unpacked(file.read_bytes()))
    except (OSError, EOFError, zlib.error) as error:  # the last two: a damaged packed file
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise CatalogError(f"{file} cannot be read ({reason}); expected {kind}") from None
    except ET.ParseError as error:
        raise CatalogError(f"{file} is not well-formed XML ({error}); expected {kind}") from None
    for element in top.iter():
        element.tag = str(element.tag).rpartition("}")[2]
    if top.tag != root:
        raise CatalogError(
            f"{file} has the root element <{top.tag}>; expected <{root}>, that of {kind}"
        )
    return Node(top, file, "header", Notes())


def unpacked(content: bytes) -> bytes:
    """Return the content of a file, which may be packed by gzip.

    Raises
    ------
    OSError, EOFError, zlib.error : the packed content is damaged.
    """
    return gzip.decompress(content) if content.startswith(GZIP) else content


def child(parent: ET.Element, tag: str, /, **attributes: object) -> ET.Element:
    """Add an element with attributes; numbers are written so that they read back bit for bit.

    Parameters
    ----------
    parent : element that receives the new one.
    tag : name of the new element.
    **attributes : attributes of the new element; those of value None are left out.
    """
    told = {name: written(value) for name, value in attributes.items() if value is not None}
    return ET.SubElement(parent, tag, told)


def written(value: object) -> str:
    """Return the text of a value for an attribute."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(float(value)) if isinstance(value, float) else str(value)
