"""The printed summary of `isethdr catalog compare`, with the path of its page."""

from __future__ import annotations

from collections.abc import Sequence

from isethdr_core.cli.sweep_summary import scored_text
from isethdr_core.cli.terminal import print_path, print_table, print_text
from isethdr_core.storage.home_folder import StoredHome
from isethdr_core.storage.object_home.calls import kept_here

from .compare import VERDICT, compare
from .report.compare_page import write_compare_page
from .space import COMPARISONS

MOST_SETTINGS = 15  # greatest number of printed settings; the page lists all


def print_comparison(homes: Sequence[StoredHome], a: str, b: str) -> None:
    """Print the settings and scores of two runs that differ. Write the page of the comparison into
    the first home, and print its path.

    Parameters
    ----------
    homes : homes in which the runs are searched for.
    a, b : first digits of the keys of two runs, or their names.

    Raises
    ------
    CatalogError : one of them is no run, or several stores match.
    """
    found = compare(homes, a, b)
    for letter, run in (("A", found.a), ("B", found.b)):
        name = f" ({run.labels.name})" if run.labels.name else ""
        print(f"{letter}: {run.path.stem}{name}, cameras {', '.join(run.cameras)}")
        if len(homes) > 1:
            print_path("   in", run.path.parent.parent)
    print("\nsettings that differ" if found.settings else "\nno setting differs")
    for setting in found.settings[:MOST_SETTINGS]:
        print_text(f"{setting.name}: {setting.a} | {setting.b}", "  ", "      ")
    if len(found.settings) > MOST_SETTINGS:
        print(f"  and {len(found.settings) - MOST_SETTINGS} more, on the page")
    if found.versions:
        print(f"versions and code of components that differ: {len(found.versions)}, on the page")
    changed = [pair for pair in found.scores if pair.differs is not False]
    several = len({pair.cameras for pair in found.scores}) > 1
    print()
    print_table(
        ["score", "unit", *(["camera"] if several else []), "A", "B", "B - A", "differ"],
        [
            [
                pair.score,
                pair.unit,
                *([pair.cameras] if several else []),
                scored_text(pair.a),
                scored_text(pair.b),
                f"{pair.difference:+.3g}",
                VERDICT[pair.differs],
            ]
            for pair in changed
        ],
    )
    same = len(found.scores) - len(changed)
    print(f"{same} scores do not differ by more than their intervals")
    page = write_compare_page(found, homes[0].folder / COMPARISONS)
    print_path(kept_here("page", page), page)
