"""Write `earlier_names.json`: the names under which results of earlier commits may be stored.

    python scripts/earlier_names.py [--measure] [COMMIT ...]

Names of the earlier commits were made of package bytes. For each commit the file states the parts
of these names, and the digest of each component under the rules of `code_digest`. A component with
the same digest in this checkout is unchanged: its syntax trees and data are the same.

A component with another digest is claimed to be unchanged only with `--measure`, and only for
values of its fields with which runs agree in both checkouts: raw values bit by bit; radiance,
pictures and scores within `AGREES`. The runs cover every registered name, every preset, and every
choice of fields with few values. The reason in the file states how many runs agree, and the largest
difference. Everything else is listed under `not_claimed`, and its results have no earlier name.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
COMMITS = ("841e2ee", "32bac9b")
AGREES = 1e-6  # largest relative difference of radiance, pictures and scores that agree
PACKAGES = (
    "isethdr_core",
    "isethdr_scenes",
    "isethdr_mitsuba",
    "isethdr_optics",
    "isethdr_sensors",
    "isethdr_isp",
    "isethdr_metrics",
)
FLAT = (
    "categories geometry light_in_time local_tone preview quantities saturation scene scores truth "
    "view white_balance"
)
FLAT_FOLLOWED = (
    "isethdr_core.physics",
    "isethdr_core.lighting",
    *(f"isethdr_core.{name}" for name in FLAT.split()),
)
FLAT_SHOWN = (
    "cli progress summary terminal hydra_app sweeps trust names claims kernels parent_watch"
)
FLAT_STORED = "store store_arrays store_join store_manifest store_reader leftovers provenance"
FLAT_OTHER = "composition forecast errors hookspecs conf testing"
FLAT_WITHOUT_RESULT = tuple(
    f"isethdr_core.{name}" for name in f"{FLAT_SHOWN} {FLAT_STORED} {FLAT_OTHER}".split()
)
DEFAULT_METRICS = "shares dynamic_range snr colour ssim log_luminance contrast detection".split()
BASE = (
    "~renderer",
    "~versions",
    "~flare.dirt",
    "scene.width=32",
    "scene.height=20",
    "scene.horizontal_field_deg=2",
    "scene.step_nm=50",
    "sensor.rows=0",
    "draws=2",
    "report=false",
    *(f"~metric.{name}" for name in DEFAULT_METRICS),
)
RENDERED = ("renderer.width=32", "renderer.height=18", "renderer.samples=4", "renderer.step_nm=100")
CHARTS = {  # name: overrides that make it fit into the small field
    "uniform": (),
    "ideal": (),
    "macbeth": (),
    "slanted_edge": (),
    "point_lights": ("scene.disc_diameter_deg=0.1",),
    "luminance_ramp": (),
}
MAIN = tuple(f"cameras.{name}.noise=false" for name in ("bayer", "split_pixel", "rgbw"))


# --- functions that run in one checkout ---


def use_checkout(root: Path) -> None:
    """Import packages from a checkout, with the entry points that its `pyproject.toml` states."""
    from importlib import metadata

    sys.path[:0] = [str(folder) for folder in folders(root)]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    entries = tuple(
        metadata.EntryPoint(name, value, "isethdr")
        for name, value in project["entry-points"]["isethdr"].items()
    )
    others = metadata.entry_points

    def entry_points(**wanted: str) -> Any:
        return entries if wanted.get("group") == "isethdr" else others(**wanted)

    metadata.entry_points = entry_points


def folders(root: Path) -> list[Path]:
    """Return the folders of a checkout that hold packages."""
    return [root, root / "plugins", root / "catalog", root / "workflows"]


def describe() -> dict:
    """Return the class and the fields of each component, which names contain besides digests."""
    import dataclasses

    from isethdr_core import components

    components_of_commit = {}
    for (kind, name), offered in components().items():
        cls = offered.cls
        components_of_commit[f"{kind}/{name}"] = {
            "module": cls.__module__,
            "name": cls.__qualname__,
            "fields": [f.name for f in dataclasses.fields(cls)],
        }
    return components_of_commit


def cases(changed: set[str]) -> dict[str, list[str]]:
    """Return the overrides of the runs that are compared, by name.

    Parameters
    ----------
    changed : components with changed code. Every choice of their fields is run; kinds without such
        a component are not run.
    """
    from isethdr_core import components

    known = components()
    metrics = [name for kind, name in known if kind == "metric"]
    all_metrics = [f"+metric@metric.all_{name}={name}" for name in metrics]
    default = {"scene": "slanted_edge", "lighting": "ideal", "lens": "diffraction_limited"}
    default |= {"sensor": "bayer", "isp": "merge"}

    def case(*more: str, **chosen: str) -> list[str]:
        chosen = default | chosen
        head = [f"{kind}={name}" for kind, name in chosen.items()]
        return [*head, *BASE, *more]

    values_of: dict[str, list[str]] = {}
    if any(name.partition("/")[0] in ("core", "metric") for name in changed):
        values_of = {"main job": [*MAIN, *RENDERED], "every metric": case(*all_metrics)}
        values_of["all computed"] = case("leave_out=false", *all_metrics)
        values_of["with a report"] = case("report=true")
    kinds = {name.partition("/")[0] for name in changed}
    if "scene" in kinds:
        values_of |= {f"scene {name}": case(*more, scene=name) for name, more in CHARTS.items()}
    for kind in kinds & {"lens", "sensor", "isp", "lighting"}:
        for name in chosen_of(kind, known):
            values_of[f"{kind} {name}"] = case(**{kind: name})
            for choice in choices_of(known.get((kind, name)), f"{kind}/{name}" in changed):
                values_of[f"{kind} {name} {choice}"] = case(f"{kind}.{choice}", **{kind: name})
    for name in chosen_of("flare", known) if "flare" in kinds else ():
        one = f"+flare@flare.one={name}"
        values_of[f"flare {name}"] = case(one)
        for choice in choices_of(known.get(("flare", name)), f"flare/{name}" in changed):
            values_of[f"flare {name} {choice}"] = case(one, f"flare.one.{choice}")
    return values_of


def choices_of(offered: Any, wanted: bool) -> list[str]:
    """Return `field=value` for every value except the default of each field with few values."""
    import dataclasses
    from typing import Literal, get_args, get_origin, get_type_hints

    if offered is None or not wanted:
        return []
    hints = get_type_hints(offered.cls)
    choices = []
    for f in dataclasses.fields(offered.cls):
        values = (True, False) if hints[f.name] is bool else ()
        if get_origin(hints[f.name]) is Literal:
            values = get_args(hints[f.name])
        choices += [f"{f.name}={json.dumps(v)}" for v in values if v != f.default]
    return choices


def chosen_of(kind: str, known: Any) -> list[str]:
    """Return the registered names and the presets of a kind."""
    presets = Path().rglob(f"conf/{kind}/*.yaml")  # a worker runs in its checkout
    return sorted({name for k, name in known if k == kind} | {preset.stem for preset in presets})


def measure(out: Path, changed: set[str], match: str) -> None:
    """Run every case and write raw values, pictures, scores, and radiance of rendered scenes."""
    import numpy as np

    import isethdr_core as hdr
    from isethdr_core.demand import Demand
    from isethdr_core.errors import IsetHdrError

    arrays: dict[str, Any] = {}
    record: dict[str, dict] = {}
    checked: dict[tuple[str, str], Any] = {}
    watch(checked)
    for name, overrides in cases(changed).items():
        if not fnmatch(name, match):
            continue
        checked.clear()
        try:
            config = hdr.compose(overrides)
            result = hdr.run(config)
        except IsetHdrError as err:
            record[name] = {"refused": str(err)}
            continue
        scores = {
            f"{s['camera']} {s['metric']} {s.get('object')}": s["value"] for s in result.scores
        }
        record[name] = {"uses": used(config), "scores": scores}
        for (kind, camera), made in checked.items():
            label = f"{name}|{camera}"
            if kind == "sensor":
                arrays[f"{label}|raw"] = made["raw"].values
            else:
                arrays[f"{label}|picture"] = made["xyz"].values
                arrays[f"{label}|variance"] = made["variance"].values
    for name, (scene, fields) in renderings(changed).items():
        if not fnmatch(name, match):
            continue
        renderer = hdr.build("renderer", "mitsuba", **fields)
        described = hdr.build("scene", scene)
        try:
            arrays[f"{name}|radiance"] = renderer(described(), Demand())["radiance"].values
        except IsetHdrError as err:
            record[name] = {"refused": str(err)}
            continue
        record[name] = {
            "uses": {f"scene/{scene}": _classes(described), "renderer/mitsuba": _classes(renderer)},
            "scores": {},
        }
    np.savez(out / "arrays.npz", **arrays)
    (out / "record.json").write_text(json.dumps(record))


def watch(checked: dict[tuple[str, str], Any]) -> None:
    """Collect in `checked` the captures and pictures that stages return, before any rounding."""
    from isethdr_core import hookimpl

    try:
        from isethdr_core.plugins.registry import plugin_manager
    except ImportError:  # an old checkout, without the folder `plugins` of the core
        from isethdr_core.registry import plugin_manager

    class Watch:
        @hookimpl
        def isethdr_after_stage(self, stage: Any) -> None:
            if stage.kind in ("sensor", "isp"):
                checked[stage.kind, stage.name] = stage.result

    plugin_manager().register(Watch())


def renderings(changed: set[str]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return (scene, fields of the renderer) of the renderings that are compared, by name."""
    from isethdr_core import components

    small = {key.rpartition(".")[2]: json.loads(v) for key, _, v in map(_parts, RENDERED)}
    by_noise = {k: v for k, v in small.items() if k != "samples"} | {"error_allowed": 0.5}
    cases_of_scenes = {name: (name, small) for name in ("night_drive", "tunnel")}
    cases_of_scenes["night_drive by its noise"] = "night_drive", by_noise
    wanted = "renderer/mitsuba" in changed
    if not wanted and not any(name.startswith("scene/") for name in changed):
        return {}
    for choice in choices_of(components()["renderer", "mitsuba"], wanted):
        key, _, value = _parts(choice)
        cases_of_scenes[f"night_drive {choice}"] = "night_drive", small | {key: json.loads(value)}
    return cases_of_scenes


def _parts(override: str) -> tuple[str, str, str]:
    return override.partition("=")


def _classes(component: Any) -> dict[str, list[str]]:
    """Return the class of values of each field; nothing in a checkout without such classes."""
    import dataclasses

    try:
        from isethdr_core.identity.earlier_names import value_class
    except ImportError:
        return {}
    return {k: [value_class(v)] for k, v in dataclasses.asdict(component).items()}


def used(config: Any) -> dict[str, dict]:
    """Return the classes of values of every component of a run and of its settings."""
    from isethdr_core import build

    nodes = [(kind, config.get(kind)) for kind in ("scene", "renderer", "lighting", "lens", "isp")]
    nodes.append(("sensor", config.get("sensor")))
    tables = {"flare": "flare", "metric": "metric", "cameras": "sensor", "versions": "lighting"}
    for table, kind in tables.items():
        nodes += [(kind, node) for node in (config.get(table) or {}).values()]
    choices_used: dict[str, dict] = {}
    for kind, node in nodes:
        if node:
            fields = {k: v for k, v in _plain(node).items() if k != "name"}
            component = build(kind, node.name, **fields)
            _add(choices_used.setdefault(f"{kind}/{node.name}", {}), _classes(component))
    choices_used["core"] = _setting_classes(config)
    return choices_used


def _setting_classes(config: Any) -> dict[str, list[str]]:
    try:
        from isethdr_core.identity.earlier_names import flat_settings, value_class
    except ImportError:
        return {}
    plain = _plain(config)
    plain = {k: v for k, v in plain.items() if k not in ("choices", "experiment", "hydra")}
    return {k: [value_class(v)] for k, v in flat_settings(plain).items()}


def _plain(config: Any) -> dict:
    from omegaconf import OmegaConf

    return OmegaConf.to_container(config, resolve=True)


def _add(values_of: dict[str, list[str]], more: dict[str, list[str]]) -> None:
    for key, values in more.items():
        values_of[key] = sorted({*values_of.get(key, ()), *values})


# --- functions that compare two checkouts ---


def write(commits: list[str], match: str) -> None:
    """Write the table for `commits`.

    Parameters
    ----------
    commits : earlier commits.
    match : pattern of the names of runs to compare if code differs; empty compares none.
    """
    from isethdr_core.identity import earlier_names
    from isethdr_core.identity.code_digest import CodeReader
    from isethdr_core.identity.core_modules import Rules
    from isethdr_core.identity.package_sources import Sources

    now = worker(ROOT, "describe")
    here = CodeReader(Sources(folders(ROOT)))
    digests = {name: here.code(c["module"], c["name"]).digest for name, c in now.items()}
    digests["core"] = here.frame().digest
    settings = settings_of(ROOT)
    table: dict[str, Any] = {
        "about": "written by scripts/earlier_names.py; explained in docs/explanation/identity.md",
        "editions": [],
        "new_settings": {},
        "unchanged": [],
        "not_claimed": [],
    }
    with tempfile.TemporaryDirectory() as scratch:
        for commit in commits:
            root = Path(scratch) / commit
            extract(commit, root)
            rules = Rules(followed=FLAT_FOLLOWED, without_result=FLAT_WITHOUT_RESULT)
            there = CodeReader(Sources(folders(root)), rules)
            edition = edition_of(commit, root, there)
            table["editions"].append(edition)
            table["new_settings"] |= new_settings(edition["settings"], settings)
            before = {name: c["code"] for name, c in edition["components"].items()}
            before["core"] = edition["frame"]
            known = {(e["of"], e["from"], e["to"]) for e in table["unchanged"]}
            differ = {n for n, d in before.items() if digests.get(n) != d}
            changed = {n for n in differ if (n, before[n], digests.get(n)) not in known}
            runs = differences(root, Path(scratch), changed, match) if match and changed else []
            claims = claimed(changed & digests.keys(), runs)
            for name in sorted(changed):
                entry = {"of": name, "commit": commit, "from": before[name]}
                entry["to"] = digests.get(name, "no longer registered")
                if name in claims:
                    entry["tested"] = claims[name]
                    table["unchanged"].append(entry | {"reason": reason(name, runs)})
                else:
                    table["not_claimed"].append(entry | {"reason": reason(name, runs)})
            print(commit, f"{len(before) - len(differ)} of {len(before)} have the same code")
    earlier_names.TABLE.write_text(json.dumps(table, indent=1) + "\n")
    for kind in ("unchanged", "not_claimed"):
        for entry in table[kind]:
            print(f"{kind:12} {entry['commit']} {entry['of']:28} {entry['reason']}")


class Compared(NamedTuple):
    """One run in both checkouts, and the settings of its components."""

    name: str
    difference: float  # largest relative difference; infinite if any raw value differs
    uses: dict[str, dict[str, list[str]]]  # classes of values, by component and field


def claimed(changed: set[str], runs: list[Compared]) -> dict[str, dict[str, list[str]]]:
    """Return by component the classes of values with which results are the same.

    A run that agrees supports a claim for all its components. A run that differs is explained if
    one of its changed components has values without such a claim. Otherwise the claims of all its
    changed components are dropped.
    """
    claims: dict[str, dict[str, list[str]]] = {}
    for run in runs:
        if run.difference <= AGREES:
            for name in changed & run.uses.keys():
                _add(claims.setdefault(name, {}), run.uses[name])
    for run in runs:
        used = changed & run.uses.keys()
        if run.difference > AGREES and all(_covers(claims.get(n), run.uses[n]) for n in used):
            for name in used:
                del claims[name]
    return claims


def _covers(claim: dict[str, list[str]] | None, classes: dict[str, list[str]]) -> bool:
    return claim is not None and all(
        set(values) <= set(claim.get(key, ())) for key, values in classes.items()
    )


def reason(name: str, runs: list[Compared]) -> str:
    """Return the result of the runs that use a component, in words."""
    own = [run for run in runs if name in run.uses]
    if not own:
        return "its code is another; no run was compared"
    agree = [run.difference for run in own if run.difference <= AGREES]
    differ = [f"{run.name} ({run.difference:.1g})" for run in own if run.difference > AGREES]
    said = f"{len(agree)} runs agree, largest relative difference {max(agree, default=0.0):.1g}"
    more = f" and {len(differ) - 4} more" if len(differ) > 4 else ""
    return said + (f"; these do not: {', '.join(differ[:4])}{more}" if differ else "")


def edition_of(commit: str, root: Path, reader: Any) -> dict:
    """Return the parts of which the names of a commit were made."""
    from isethdr_core.identity import earlier_names

    bytes_of = {name: earlier_names.folder_digest([package(root, name)]) for name in PACKAGES}
    for module in earlier_names.RADIANCE_CORE:
        bytes_of[module] = earlier_names.file_digest(root / (module.replace(".", "/") + ".py"))
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    return {
        "commit": commit,
        "version": project["version"],
        "packages": bytes_of,
        "components": {
            name: {
                "class": f"{c['module']}.{c['name']}",
                "fields": c["fields"],
                "code": reader.code(c["module"], c["name"]).digest,
            }
            for name, c in worker(root, "describe").items()
        },
        "frame": reader.frame().digest,
        "settings": settings_of(root),
    }


def package(root: Path, name: str) -> Path:
    """Return the folder of a package in a checkout."""
    return next(folder / name for folder in folders(root) if (folder / name).is_dir())


def settings_of(root: Path) -> dict:
    """Return the settings in the default config of a checkout, without components."""
    import yaml

    [path] = (root / "isethdr_core").rglob("conf/config.yaml")
    config = yaml.safe_load(path.read_text())
    return {key: value for key, value in config.items() if key not in ("defaults", "hydra")}


def new_settings(before: dict, now: dict, path: str = "") -> dict:
    """Return {path: default} of the settings that a commit did not have."""
    settings_of = {}
    for key, value in now.items():
        if key not in before:
            settings_of[path + key] = value
        elif isinstance(value, dict) and isinstance(before[key], dict):
            settings_of |= new_settings(before[key], value, f"{path}{key}.")
    return settings_of


def extract(commit: str, root: Path) -> None:
    """Write the files of a commit into a folder."""
    root.mkdir()
    archive = subprocess.run(
        ["git", "archive", commit], cwd=ROOT, check=True, stdout=subprocess.PIPE
    ).stdout
    subprocess.run(["tar", "x", "-C", str(root)], input=archive, check=True)


def worker(root: Path, task: str, out: Path | None = None, more: Iterable[str] = ()) -> Any:
    """Run one task of this script in a process that imports from a checkout."""
    command = [sys.executable, __file__, "--task", task, "--root", str(root)]
    command += ["--out", str(out), *more] if out else []
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment |= {"ISETHDR_HOME": str(out / "home")} if out else {}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True, cwd=root)
    return json.loads(done.stdout.splitlines()[-1]) if task == "describe" else None


def differences(root: Path, scratch: Path, changed: set[str], match: str) -> list[Compared]:
    """Return the comparison of every run that both checkouts can make."""
    import numpy as np

    outs = []
    for tree in (root, ROOT):
        out = scratch / f"measured {root.name} {'now' if tree == ROOT else 'then'}"
        out.mkdir()
        worker(tree, "measure", out, ["--match", match, "--changed", *sorted(changed)])
        outs.append(out)
    before, now = (json.loads((out / "record.json").read_text()) for out in outs)
    arrays = [np.load(out / "arrays.npz") for out in outs]
    rows = []
    for name, run in now.items():
        refused = [r["refused"] for r in (before.get(name, {}), run) if "refused" in r]
        if refused or name not in before:
            print(f"not compared: {name}: {refused}")
            continue
        pairs = [(before[name]["scores"].get(k), v) for k, v in run["scores"].items()]
        values = [relative(np.array(a, float), np.array(b, float)) for a, b in pairs]
        for key in (k for k in arrays[0].files if k.startswith(f"{name}|")):
            difference = relative(arrays[0][key], arrays[1][key])
            values.append(math.inf if key.endswith("|raw") and difference else difference)
        if values:  # empty if the earlier checkout has no values under this name
            rows.append(Compared(name, max(values), run["uses"]))
    return rows


def relative(before: Any, now: Any) -> float:
    """Return the largest difference of two arrays over the largest magnitude.

    It is infinite where shapes differ.
    """
    import numpy as np

    if before.shape != now.shape or not np.array_equal(np.isfinite(before), np.isfinite(now)):
        return math.inf
    before, now = (np.where(np.isfinite(a), a, 0.0).astype(float) for a in (before, now))
    largest = float(np.max(np.abs(before), initial=0.0))
    difference = float(np.max(np.abs(before - now), initial=0.0))
    return difference / largest if largest else (0.0 if difference == 0 else math.inf)


def main() -> None:
    """Run the task that the command line selects."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commits", nargs="*", default=COMMITS)
    parser.add_argument("--measure", action="store_true", help="compare runs where code differs")
    parser.add_argument("--match", default="*", help="names of the runs to compare, as a pattern")
    parser.add_argument("--task", help=argparse.SUPPRESS)
    parser.add_argument("--root", type=Path, default=ROOT, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--changed", nargs="*", default=(), help=argparse.SUPPRESS)
    options = parser.parse_args()
    use_checkout(options.root)
    if options.task == "describe":
        print(json.dumps(describe()))
    elif options.task == "measure":
        measure(options.out, set(options.changed), options.match)
    else:
        write(list(options.commits), options.match if options.measure else "")


if __name__ == "__main__":
    main()
