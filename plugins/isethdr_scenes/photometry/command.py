"""`isethdr lamp`: check a lamp against its rules, and draw its isocandela plot.

This module imports nothing slow, because every command line loads it.
"""

from __future__ import annotations

from importlib import import_module


def lamp_command(lamp: str, rules: str = "", plot: str = "") -> None:
    """Check the luminous intensity of a lamp against regulations.

    LAMP is a bundled family, such as dipped_r112_b, or a file (.ies, .ldt). --rules names sets of
    rules, separated by commas; a bundled family has its own. --plot writes an isocandela plot to
    this file.
    """
    import_module(f"{__package__}.report").report(lamp, rules, plot)
