"""Check the built site with Chromium: no page is wider than the screen of a phone.

    python scripts/check_widths.py site     # exit code 1, and a line for each page that is wider

Without Chromium nothing is checked, and a line says so. A page that is wider makes the reader
scroll sideways for each line. Tables and code blocks may scroll within themselves.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from html import unescape
from pathlib import Path

PHONE_PX = 390
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
TIMEOUT_S = 600
# Pages are loaded one after another into frames of the phone's width. Each frame is created before
# the previous one is removed, so that Chromium waits for all of them.
MEASURE = """<!doctype html><body><pre></pre><script>
const pages = PAGES, found = document.querySelector("pre");
function measure(k) {
  if (k === pages.length) { found.textContent += "measured " + k; return; }
  const frame = document.createElement("iframe");
  frame.style.cssText = "width: WIDTHpx; height: 844px; border: 0";
  frame.onload = () => {
    const width_px = frame.contentDocument.documentElement.scrollWidth;
    if (width_px > WIDTH) found.textContent += pages[k][0] + ": " + width_px + " px\\n";
    measure(k + 1);
    frame.remove();
  };
  frame.src = pages[k][1];
  document.body.append(frame);
}
measure(0);
</script>"""


def chromium() -> str | None:
    """Return the path of Chromium; None if it is not installed."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


def wider(site: Path, program: str, width_px: int = PHONE_PX) -> list[str]:
    """Return `file: width` for all pages of a site that are wider than the screen.

    Parameters
    ----------
    site : folder of the site.
    program : path of Chromium.
    width_px : width of the screen in CSS pixels.

    Raises
    ------
    RuntimeError : Chromium did not measure all pages.
    """
    pages = [
        (path.relative_to(site).as_posix(), path.resolve().as_uri())
        for path in sorted(site.rglob("*.html"))
    ]
    text = MEASURE.replace("PAGES", json.dumps(pages)).replace("WIDTH", str(width_px))
    with tempfile.TemporaryDirectory() as folder:
        measuring = Path(folder, "measure.html")
        measuring.write_text(text, "utf-8")
        command = [
            program,
            "--headless",
            "--disable-gpu",
            *(["--no-sandbox"] if os.geteuid() == 0 else []),  # Chromium refuses it to root
            "--allow-file-access-from-files",
            f"--user-data-dir={folder}/profile",
            "--dump-dom",
            measuring.as_uri(),
        ]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=TIMEOUT_S
        )
    match = re.search(r"<pre>(.*?)measured (\d+)</pre>", done.stdout, re.DOTALL)
    if match is None or int(match[2]) != len(pages):
        raise RuntimeError(
            f"{program} did not measure all {len(pages)} pages: {done.stderr[-500:]}"
        )
    return unescape(match[1]).splitlines()


def main(arguments: list[str]) -> int:
    """Print which pages of the site in the folder of the first argument are wider than a phone."""
    site = Path(arguments[0])
    program = chromium()
    if program is None:
        print("Chromium is not installed; the widths of the pages are not checked", file=sys.stderr)
        return 0
    found = wider(site, program)
    print("\n".join(found) or f"{site}: no page is wider than {PHONE_PX} px")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
