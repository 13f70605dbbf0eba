"""Hooks that MkDocs calls (mkdocs.yml) to change the pages of docs for the site.

- README, changelog and guide for contributors of the repository become pages.
- A link from a page to one of them leads to that page.
- The pages of examples show the example files.
"""

from __future__ import annotations

import re
from pathlib import Path
from posixpath import normpath, relpath
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
# file of the repository: page of the site
MOVED = {
    "README.md": "about.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
LINK = re.compile(r"\]\((?!\w+:|#)([^)#\s]+)(#[^)]*)?\)")
EXAMPLE = re.compile(r"^\[YAML\]\((.+\.yaml)\), \[Python\]\((.+\.py)\)\.$", re.MULTILINE)


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are files of the repository."""
    for source, page in MOVED.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text("utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Return the text of a page with links for the site, and with the files of examples."""
    place = page.file.src_uri
    folder = ("docs/" + place).rpartition("/")[0]
    sources = {page: source for source, page in MOVED.items()}
    if place in sources:
        folder = ""

    def relinked(match: re.Match[str]) -> str:
        target = normpath(f"{folder}/{match[1]}".lstrip("/"))
        anchor = match[2] or ""
        if target in MOVED:
            target = f"docs/{MOVED[target]}"
        if not target.startswith("docs/"):
            return "]" if target != "LICENSE" else "](about.md)"
        return f"]({relpath(target, ('docs/' + place).rpartition('/')[0])}{anchor})"

    def shown(match: re.Match[str]) -> str:
        blocks = [match[0]]
        for path, language in ((match[1], "yaml"), (match[2], "python")):
            text = (ROOT / folder / path).read_text("utf-8")
            title = path.rpartition("/")[2]
            blocks.append(f'```{language} title="{title}"\n{text}```')
        return "\n\n".join(blocks)

    return EXAMPLE.sub(shown, LINK.sub(relinked, markdown))
