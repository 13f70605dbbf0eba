"""What `isethdr plugins` prints: every component with its fields. It loads nothing of a run."""

from __future__ import annotations

from rich.text import Text

from ..errors import ConfigError, did_you_mean
from ..plugins import registry
from ..plugins.component import KINDS
from ..plugins.descriptions import descriptions
from .terminal import console as open_console


def print_plugins(kind: str = "") -> int:
    """Print every component with its fields; return how many plugins are broken."""
    if kind and kind not in KINDS:
        raise ConfigError(f"no kind {kind!r}{did_you_mean(kind, KINDS)}")
    console = open_console()
    kinds = [kind] if kind else list(KINDS)
    members = [comp for comp in registry.components().values() if comp.kind in kinds]
    shown, failed = descriptions(members)
    for k in kinds:
        console.print(k, style="bold")
        for comp in sorted((c for c in shown if c.kind == k), key=lambda c: c.name):
            line = Text.assemble(
                ("  " + comp.name, "cyan"),
                f"  {shown[comp].summary}  ",
                (f"({comp.package})", "dim"),
            )
            console.print(line, soft_wrap=True)
            if shown[comp].fields:
                fields = "  ".join(shown[comp].fields)
                console.print(f"      {fields}", style="dim", soft_wrap=True)
    every = [*registry.broken_plugins(), *failed]
    for broken in every:
        text = f"broken plugin {broken.entry_point} (package {broken.package}): {broken.reason}"
        console.print(text, style="bold red")
    return len(every)
