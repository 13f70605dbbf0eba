"""Check a bundled lamp or a file against rules, and print the result."""

from __future__ import annotations

from pathlib import Path

from isethdr_core.errors import ConfigError, did_you_mean

from .eulumdat import read_ldt
from .families import FAMILIES, LampPattern, family
from .iesna import read_ies
from .isocandela import checked_path
from .isocandela import plot as draw
from .rules import Finding, check, rule_sets

READERS = {".ies": read_ies, ".ldt": read_ldt}


def lamp_of(lamp: str, rules: str = "") -> LampPattern:
    """Return a bundled lamp or the lamp of a file, with its rules.

    Parameters
    ----------
    lamp : name of a bundled family, or the path of a .ies or .ldt file.
    rules : names of sets of rules, separated by commas; empty: those of the family.

    Raises
    ------
    ConfigError : no such lamp or file, a file that cannot be read, or no such rules.
    """
    rule_names = tuple(r.strip() for r in rules.split(",") if r.strip())
    for name in rule_names:
        if name not in rule_sets():
            raise ConfigError(f"there is no set of rules {name!r}{did_you_mean(name, rule_sets())}")
    if lamp in FAMILIES:
        lamp_family = family(lamp)
        return lamp_family._replace(rules=rule_names or lamp_family.rules)
    path = Path(lamp)
    if path.suffix.lower() not in READERS:
        raise ConfigError(
            f"there is no lamp {lamp!r}{did_you_mean(lamp, FAMILIES)}; a file ends in .ies or .ldt"
        )
    if not path.is_file():
        raise ConfigError(f"there is no file {lamp}; type a path to a file of LM-63 or EULUMDAT")
    return LampPattern(*READERS[path.suffix.lower()](path), rule_names)


def report(lamp: str, rules: str = "", plot: str = "") -> bool:
    """Print the intensities of a lamp at the points of each rule; return whether all rules are met.

    Parameters
    ----------
    lamp : a family of lamps, or the path of a .ies or .ldt file.
    rules : names of sets of rules, separated by commas; empty: those of the lamp.
    plot : path of a picture for the isocandela plot; empty: no plot.

    Raises
    ------
    ConfigError : as `lamp_of`; or the format of the picture is unknown.
    CatalogError : the picture cannot be written.
    """
    lamp_data = lamp_of(lamp, rules)
    picture = checked_path(plot) if plot else None
    everything: list[Finding] = []
    print(f"{lamp}: largest intensity {lamp_data.intensity_cd:.4g} cd")
    for name in lamp_data.rules:
        findings = check(lamp_data.table, lamp_data.intensity_cd, name)
        broken = sum(not f.is_met for f in findings)
        print(f"\n{name}: {len(findings) - broken} of {len(findings)} rules are met")
        for f in findings:
            is_limit = f.low_cd == f.high_cd
            value = f"{f.low_cd:.4g}" if is_limit else f"{f.low_cd:.4g}-{f.high_cd:.4g}"
            limits = f"{f.least_cd:g} to {f.most_cd:g}"
            verdict = "" if f.is_met else "BROKEN"
            print(f"  {f.rule.name:12s} {value:>16s} cd   {limits:20s} {verdict}".rstrip())
        everything += findings
    if not lamp_data.rules:
        print(f"no rules are chosen; type --rules with one of {', '.join(rule_sets())}")
    if picture:
        draw(picture, lamp, lamp_data.table, lamp_data.intensity_cd, everything)
        print(f"\nplot: {plot}")
    return all(f.is_met for f in everything)
