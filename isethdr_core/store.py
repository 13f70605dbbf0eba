"""Public path of `storage.store`."""

from .storage.encoding import jsonable
from .storage.store import (
    FORMAT,
    ROOT_FILE,
    WITHOUT_MANIFEST,
    content_hash,
    find_complete,
    holes,
    home,
    open_scene,
    open_store,
    read_attrs,
    write_store,
)

__all__ = [
    "FORMAT",
    "ROOT_FILE",
    "WITHOUT_MANIFEST",
    "content_hash",
    "find_complete",
    "holes",
    "home",
    "jsonable",
    "open_scene",
    "open_store",
    "read_attrs",
    "write_store",
]
