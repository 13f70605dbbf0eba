"""Addresses of object homes, and the scratch folder of each."""

from __future__ import annotations

import hashlib
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path

from ...errors import CatalogError, ConfigError
from ..atomic_write import write_text

SCHEME = "s3://"
SCRATCH = "ISETHDR_SCRATCH"
MARK = "object_home.json"  # file of a scratch folder that holds the address
STUB = ".stub"  # file that marks a local store with its other files in the bucket only
ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT")


@dataclass(frozen=True)
class Address:
    """Bucket and prefix of an object home."""

    bucket: str
    prefix: str  # without slashes at both ends; may be empty

    @property
    def url(self) -> str:
        """The address as it is typed."""
        return f"{SCHEME}{self.bucket}" + (f"/{self.prefix}" if self.prefix else "")

    @classmethod
    def parsed(cls, text: str) -> Address:
        """Return the address that a user typed.

        Raises
        ------
        ConfigError : another scheme, no bucket, or a prefix with empty or relative parts.
        """
        bucket, _, prefix = text.removeprefix(SCHEME).partition("/")
        parts = prefix.rstrip("/").split("/") if prefix.rstrip("/") else []
        right = re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", bucket) and all(
            re.fullmatch(r"[\w.=-]+", part, re.ASCII) and part not in (".", "..") for part in parts
        )
        if not text.startswith(SCHEME) or not right:
            raise ConfigError(
                f"the home is {text!r}; expected a folder, or {SCHEME}bucket/prefix of letters,"
                f" digits, '_', '-', '.' and '='; type for example --home {SCHEME}bucket/isethdr"
            )
        return cls(bucket, "/".join(parts))


def is_address(text: str) -> bool:
    """Return whether a home is meant as an address, not as a folder."""
    return "://" in text


def scratch_folder(address: Address) -> Path:
    """Return the scratch folder of an object home on this machine; it is made if missing.

    Raises
    ------
    CatalogError : it cannot be made.
    """
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    root = Path(os.environ.get(SCRATCH) or Path(cache) / "isethdr" / "homes").expanduser()
    # buckets of two servers may have the same name
    server = next(filter(None, map(os.environ.get, ENDPOINTS)), "")
    digest = hashlib.sha256(f"{server} {address.url}".encode()).hexdigest()[:12]
    folder = root.absolute() / f"{address.bucket}-{digest}"
    if not (folder / MARK).exists():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / MARK, json.dumps({"url": address.url}))
        except OSError as error:
            raise CatalogError(
                f"cannot make the scratch folder {folder} of {address.url}: {error.strerror};"
                f" choose another one with {SCRATCH}=/path"
            ) from error
    return folder


def address_of(folder: Path) -> Address | None:
    """Return the address of the object home whose scratch folder this is; None for other
    folders.
    """
    try:
        return Address.parsed(json.loads((folder / MARK).read_text(encoding="utf-8"))["url"])
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        # no folder, or one that cannot be read: a later write into it reports the error
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CatalogError(
            f"the scratch folder {folder} is damaged: {MARK} cannot be read ({error}); remove"
            " that folder, the object home keeps its stores"
        ) from None
