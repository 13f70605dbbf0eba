"""Actions behind the command `isethdr dataset`: they compute, write and print."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import typer

from isethdr_core.cli.terminal import duration, number_of, print_path, print_table
from isethdr_core.errors import ConfigError
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import existing_home
from isethdr_core.storage.object_home.calls import kept_here

from .card import write_card
from .draw import family_of
from .generate import Generated, Request, generate, generated
from .page import write_page
from .pairs.making import make_pairs
from .pairs.request import pair_request
from .recipe import read_recipe
from .record import DEFINITION, folder_of, read_dataset, unchecked_files
from .runtime_estimate import RuntimeEstimate, runtime_estimate
from .splits import splits
from .study.cameras import imaged
from .study.files import write_files
from .study.markdown import with_interval
from .study.tables import tables_of
from .verify import verify
from .workers import PROCESSES, RAY, SLURM, Workers

# the command's own settings, which are not overrides, and their types
OWN = {
    "count": int,
    "seed": int,
    "recipe": str,
    "sample": int,
    "engine": str,
    "workers": int,
    "hours": float,
    "partition": str,
    "cpus": int,
}
# {setting: field of Workers}
OF_WORKERS = {
    "engine": "engine",
    "workers": "count",
    "hours": "hours",
    "partition": "partition",
    "cpus": "cpus",
}
# {setting: engines that use it}
USED_BY = {
    "workers": (PROCESSES, SLURM, RAY),
    "hours": (SLURM,),
    "partition": (SLURM,),
    "cpus": (SLURM, RAY),
}
INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT
SAMPLE = 6  # number of scenes that give a useful runtime estimate


def make(name: str, settings: list[str], dry_run: bool, price: float | None) -> None:
    """Make the missing scenes of a dataset, or show what would be made.

    Parameters
    ----------
    name : name of the dataset.
    settings : settings as typed, key=value.
    dry_run : whether to only show what would be made.
    price : price of an hour of this machine; None: no cost is printed.
    """
    request = request_of(name, settings)
    if dry_run:
        print_draws(request)
        stored = (folder_of(name) / DEFINITION).exists()
        made = generated(read_dataset(name)).made if stored else []
        print_runtime_estimate(runtime_estimate(made, request.count), settings, request, price)
        return
    try:
        dataset = generate(request)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    print_generated(dataset)
    if request.sample is not None and request.sample < request.count:
        expected = runtime_estimate(dataset.made, request.count)
        print_runtime_estimate(expected, settings, request, price)
    if dataset.failed:
        raise typer.Exit(1)


def score(name: str, settings: list[str]) -> None:
    """Image the scenes of a dataset, print the objects by class, and write page and tables; exit
    code 1 if a scene failed.

    Parameters
    ----------
    name : name of the dataset.
    settings : settings as typed, key=value: those of the workers, and overrides of all runs.
    """
    own, overrides = divided(settings, OF_WORKERS)
    workers = workers_of(own)
    dataset = generated(read_dataset(name))
    if not dataset.made:
        raise ConfigError(
            f"the dataset {name!r} has no scene yet; expected at least one; type for example"
            f" isethdr dataset generate {name}"
        )
    try:
        found = imaged(dataset, overrides, print, workers)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    tables = tables_of(found)
    rows = [
        (row.name, row.objects, *(with_interval(mean) for mean in row.means))
        for row in tables.objects["class"]
        if row.objects
    ]
    if rows:
        print("mean detection probability of objects, with 95 % intervals over roads:")
        print_table(["class", "objects", *tables.cameras], rows)
    else:
        print("no object has a detection score")
    paths = write_files(dataset, found, overrides)
    for title, path in zip(("page", "text", "means", "objects"), paths, strict=True):
        print_path(kept_here(title, path), path)
    if found.failed:
        print(f"{len(found.failed)} of {len(dataset.made)} scenes failed")
        raise typer.Exit(1)


def pair(name: str, settings: list[str]) -> None:
    """Make the pairs that are missing, and print where they are; exit code 1 if a scene failed.

    Parameters
    ----------
    name : name of a dataset, or of one stored scene.
    settings : settings as typed, key=value.
    """
    request = pair_request(name, settings)
    try:
        made = make_pairs(request)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    print(f"pairs of {number_of(made.scenes, 'scene')} are written")
    print_path("pairs", made.folder)
    if made.failed:
        print(
            f"{number_of(len(made.failed), 'scene')} failed, the first because: {made.failed[0][1]}"
        )
        raise typer.Exit(1)


def report(name: str) -> None:
    """Write the page of a dataset."""
    page = write_page(generated(read_dataset(name)))
    print_path(kept_here("page", page), page)


def check(name: str) -> None:
    """Print the problems of a dataset; exit code 1 if there are any, or if scenes are missing."""
    dataset = generated(read_dataset(name))
    problems = verify(dataset)
    for problem in problems:
        print(f"scene {problem.number + 1}: {problem.what}")
    if unchecked := unchecked_files(dataset.scenes.values()):
        path, reason = next(iter(unchecked.items()))
        files = number_of(len(unchecked), "file")
        print(f"not checked: {files} that the scenes use, for example {path}, {reason}")
    made = len(dataset.made)
    affected = len({problem.number for problem in problems})
    print(f"{made} of {dataset.definition.count} scenes are made; {affected} have a problem")
    if problems or made < dataset.definition.count:
        raise typer.Exit(1)


def split(name: str) -> None:
    """Write and print the parts of a dataset."""
    definition = read_dataset(name)
    parts = splits(definition.scenes(), definition.recipe.splits)
    path = folder_of(name) / "splits.json"
    write_text(path, json.dumps(parts))
    print_table(["part", "scenes"], [(part, len(numbers)) for part, numbers in parts.items()])
    print_path("numbers of the scenes, from 0", path)


def describe(name: str) -> None:
    """Write the card of a dataset."""
    card = write_card(generated(read_dataset(name)))
    print_path(kept_here("card", card), card)


def list_all() -> None:
    """Print the datasets of the home folder."""
    rows = []
    for path in sorted(existing_home().glob(f"datasets/*/{DEFINITION}")):
        dataset = generated(read_dataset(path.parent.name))
        definition = dataset.definition
        size = sum(record.stored_bytes for record in dataset.made) / 1e9
        made = f"{len(dataset.made)} of {definition.count}"
        rows.append(
            (definition.name, made, len(dataset.failed), f"{size:.3g}", definition.recipe_name)
        )
    print_table(["dataset", "scenes", "failed", "GB", "recipe"], rows)


def request_of(name: str, settings: list[str]) -> Request:
    """Return the request of a command line.

    Parameters
    ----------
    name : name of the dataset.
    settings : settings as typed, key=value: those of the dataset, and overrides of its scenes.

    Raises
    ------
    ConfigError : a value of the dataset's own settings is no number.
    """
    own, overrides = divided(settings, OWN)
    workers = workers_of(own)
    others = {key: value for key, value in own.items() if key not in OF_WORKERS}
    return Request(name, overrides=tuple(overrides), workers=workers, **others)


def divided(settings: list[str], keys: Collection[str]) -> tuple[dict[str, Any], list[str]]:
    """Separate the command's own settings from overrides.

    Parameters
    ----------
    settings : settings as typed, key=value.
    keys : keys of `OWN` that the command has.

    Returns
    -------
    {key: value} of the type that `OWN` names; and the other settings.

    Raises
    ------
    ConfigError : a value of the command's own settings is no number.
    """
    own: dict[str, Any] = {}
    overrides = []
    for text in settings:
        key, is_setting, value = text.partition("=")
        if not is_setting or key not in keys:
            overrides.append(text)
            continue
        try:
            own[key] = OWN[key](value)
        except ValueError:
            raise ConfigError(
                f"{key} is {value!r}; expected a number; type for example {key}=6"
            ) from None
    return own, overrides


def workers_of(own: Mapping[str, Any]) -> Workers:
    """Return the workers that settings name. Several workers without an engine are processes.

    Parameters
    ----------
    own : {key: value}, as `divided` returns it.

    Raises
    ------
    ConfigError : a setting is wrong, or the engine does not use it.
    """
    fields = {field: own[key] for key, field in OF_WORKERS.items() if key in own}
    if fields.get("count", 1) != 1 and "engine" not in fields:
        fields["engine"] = PROCESSES
    workers = Workers(**fields)
    for key, engines in USED_BY.items():
        is_default = key == "workers" and workers.count == 1
        if key in own and workers.engine not in engines and not is_default:
            raise ConfigError(
                f"{key}={own[key]} has no effect with engine={workers.engine}; expected"
                f" engine={' or engine='.join(engines)}; type for example engine={engines[0]}"
                f" {key}={own[key]}"
            )
    return workers


def print_draws(request: Request) -> None:
    """Print how many scenes of each family a dataset would have."""
    recipe = read_recipe(request.recipe)
    count: dict[str, int] = {family.name: 0 for family in recipe.families}
    for number in range(request.count):
        count[family_of(recipe, request.seed, number).name] += 1
    rows = [
        (family.name, count[family.name], " ".join(sorted(family.draw)))
        for family in recipe.families
    ]
    print_table(["family", "scenes", "drawn"], rows)


def print_generated(dataset: Generated) -> None:
    """Print how many scenes are made, and which failed."""
    made = len(dataset.made)
    count = dataset.definition.count
    print(f"{made} of {count} scenes are made")
    for record in dataset.failed:
        print(f"scene {record.number + 1} failed: {record.error.splitlines()[0]}")
    if dataset.failed:
        print_path("tracebacks", folder_of(dataset.definition.name) / "failed")
    print(f"next: isethdr dataset report {dataset.definition.name}")


def print_runtime_estimate(
    expected: RuntimeEstimate | None, settings: Sequence[str], request: Request, price: float | None
) -> None:
    """Print time, disk and cost of all scenes.

    Parameters
    ----------
    expected : the estimate; None if fewer than two scenes are made.
    settings : settings of the dataset as typed, key=value.
    request : the dataset.
    price : price of an hour of the machine; None: no cost is printed.
    """
    if expected is None:
        print("no runtime estimate: fewer than two scenes are made")
        if request.count > SAMPLE:
            typed = [setting for setting in settings if not setting.startswith("sample=")]
            command = shlex.join(["isethdr", "dataset", "generate", request.name, *typed])
            print(f"render a sample first: {command} sample={SAMPLE}")
        return
    time = expected.seconds
    size = expected.stored_bytes
    rows = [
        ("time of one machine", *(duration(v) for v in (time.value, time.low, time.high))),
        ("disk", *(f"{v / 1e9:.3g} GB" for v in (size.value, size.low, size.high))),
    ]
    if expected.cpu_seconds is not None:  # unlike the time, it does not grow with other work
        cpu = expected.cpu_seconds
        limits = (cpu.value, cpu.low, cpu.high)
        rows.insert(1, ("processor time", *(duration(v) for v in limits)))
    if price is not None:
        rows.append(
            ("cost", *(f"{price * v / 3600:.2f}" for v in (time.value, time.low, time.high)))
        )
    scenes = number_of(request.count, "scene")
    print(f"estimate for {scenes} from {expected.sample} rendered, with 95 % limits:")
    print_table(["", "expected", "at least", "at most"], rows)
