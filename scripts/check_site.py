"""Check the built site: its pages load nothing from a network.

    python scripts/check_site.py site     # exit code 1, and a line for each thing that is loaded

Links that a reader may follow are allowed; scripts, styles, pictures, fonts and frames are not.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

# tag: attribute with an address that a browser loads without a click
LOADED = {
    "audio": "src",
    "embed": "src",
    "iframe": "src",
    "img": "src",
    "link": "href",
    "object": "data",
    "script": "src",
    "source": "src",
    "video": "src",
}
OUTSIDE = re.compile(r"(?:https?:)?//")
IN_STYLES = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])((?:https?:)?//[^'\")\s]+)")
HARMLESS_LINKS = {"canonical", "next", "prev", "edit", "alternate"}  # browsers do not load these


class Loads(HTMLParser):
    """Parser that collects the addresses outside the site that a page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect the addresses that one tag loads."""
        values = {name: value or "" for name, value in attrs}
        if tag == "link" and values.get("rel") in HARMLESS_LINKS:
            return
        address = values.get(LOADED.get(tag, ""), "")
        if OUTSIDE.match(address):
            self.found.append(address)
        self.found += IN_STYLES.findall(values.get("style", ""))


def loads(site: Path) -> list[str]:
    """Return `file: address` for each address outside the site that its pages and styles load."""
    found = []
    for path in sorted(site.rglob("*.html")):
        page = Loads()
        text = path.read_text("utf-8")
        page.feed(text)
        found += [f"{path.relative_to(site)}: {address}" for address in page.found]
        for style in re.findall(r"<style.*?</style>", text, re.DOTALL):
            found += [f"{path.relative_to(site)}: {a}" for a in IN_STYLES.findall(style)]
    for path in sorted(site.rglob("*.css")):
        found += [f"{path.relative_to(site)}: {a}" for a in IN_STYLES.findall(path.read_text())]
    return found


def main(arguments: list[str]) -> int:
    """Print the outside addresses that a site loads; the first argument is the site's folder."""
    site = Path(arguments[0])
    if not (site / "index.html").is_file():
        print(f"{site} holds no site; make one with: make docs", file=sys.stderr)
        return 2
    found = loads(site)
    print("\n".join(found) or f"{site}: nothing is loaded from a network")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
