"""Labels: name, tags and sweeps of a stored run, in a file beside its store.

A store never changes, and its name is the hash of what made it. A label says what a person calls a
run, so it may be added later, and is part of no hash.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..errors import ConfigError
from ..storage.atomic_write import write_text
from ..storage.object_home.calls import share_labels

SUFFIX = ".labels.json"
ALLOWED = re.compile(r"[\w.-]+")
SETTINGS = ("name", "tags")  # settings of a config that are labels
MOST = 100  # largest number of characters, because a sweep's name becomes a folder
MOST_BYTES = 255  # largest length of a folder's name in UTF-8, for names in other scripts


@dataclass(frozen=True)
class Labels:
    """What people call a run."""

    name: str = ""
    tags: tuple[str, ...] = ()
    sweeps: tuple[str, ...] = ()  # names of the sweeps that it is a job of

    def __or__(self, other: Labels) -> Labels:
        """Return the labels of both; the name of `other` replaces that of this one."""
        return Labels(
            other.name or self.name,
            tuple(dict.fromkeys([*self.tags, *other.tags])),
            tuple(dict.fromkeys([*self.sweeps, *other.sweeps])),
        )


def labels_of(config: Mapping[str, Any]) -> Labels:
    """Return the name and the tags that a config sets.

    Raises
    ------
    ConfigError : a name or a tag holds a character that is not allowed.
    """
    tags = config.get("tags") or ()
    if isinstance(tags, str) or not isinstance(tags, Iterable):
        tags = [tags]
    return Labels(
        checked("name", config.get("name") or ""),
        tuple(checked("tag", tag) for tag in tags),
    )


def checked(kind: str, text: object) -> str:
    """Return a name or a tag as text; "" for none.

    Parameters
    ----------
    kind : `name` or `tag`, for the message.
    text : the name or the tag.

    Raises
    ------
    ConfigError : the text holds a character other than letters, digits, `_`, `-` and `.`, or only
        dots, or more than 100 characters, or more than 255 bytes in UTF-8.
    """
    shown = str(text)
    if shown == "":
        return ""
    allowed = ALLOWED.fullmatch(shown) and set(shown) != {"."}
    if not allowed or len(shown) > MOST or len(shown.encode()) > MOST_BYTES:
        shortened = re.sub(r"[^\w.-]+", "_", shown).encode()[:MOST].decode(errors="ignore")
        example = shortened.strip("._") or "night"
        typed = f"name={example}" if kind == "name" else f"tags=[{example}]"
        raise ConfigError(
            f"the {kind} is {shown[:MOST]!r}; expected at most {MOST} letters, digits, '_', '-'"
            f" and '.', of at most {MOST_BYTES} bytes in all; type for example {typed}"
        )
    return shown


def read_labels(store: Path) -> Labels:
    """Return the labels of the run in `store`; none if their file is missing or damaged."""
    try:
        return _decoded(path_of(store).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return Labels()


def add_labels(store: Path, labels: Labels) -> None:
    """Add labels to those of a stored run. Nothing is written if the run has them already.

    Raises
    ------
    CatalogError : the run belongs to an object home, and a request fails.
    """
    labels_before = read_labels(store)
    if labels_before | labels == labels_before:
        return
    shared = share_labels(path_of(store), lambda text: _encoded(_decoded(text) | labels))
    if not shared:
        write_text(path_of(store), _encoded(labels_before | labels))


def _encoded(labels: Labels) -> str:
    return json.dumps(asdict(labels))


def _decoded(text: str) -> Labels:
    """Return the labels that a file holds; none if it is empty or damaged."""
    try:
        stored = json.loads(text)
        return Labels(
            str(stored["name"]), tuple(map(str, stored["tags"])), tuple(map(str, stored["sweeps"]))
        )
    except (ValueError, KeyError, TypeError):
        return Labels()


def path_of(store: Path) -> Path:
    """Return the path of the file with the labels of the run in `store`."""
    return store.with_suffix(SUFFIX)
