"""`isethdr roads`: kinds of road, drawn and written; road files, checked and drawn.

Imports nothing that takes time: every command line loads this file.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import typer

from isethdr_core.errors import CatalogError

roads_command = typer.Typer(
    help="Kinds of road, and road files: list, draw, write, check.", no_args_is_help=True
)
ROADS = __package__.rpartition(".")[0]


@roads_command.command("list")
def list_command() -> None:
    """List the kinds of road."""
    for name in import_module(f"{ROADS}.kinds").names():
        typer.echo(name)


@roads_command.command("sheet", short_help="Draw kinds of road, or the plan of a road file.")
def sheet_command(
    what: Path = typer.Argument(
        help="folder to write the sheets of kinds into; or a road file (.xodr) to draw"
    ),
    out: Path = typer.Argument(
        None, help="picture of the road file to write; by default next to the file"
    ),
    seeds: int = typer.Option(1, min=1, help="number of sheets, each with another seed"),
    kinds: str = typer.Option("", help="names of kinds, separated by commas; by default all"),
) -> None:
    """Draw kinds of road from above, one PNG per seed; or the plan of a road file."""
    if what.suffix == ".xodr":
        plan = import_module(f"{__package__}.file_plan")
        typer.echo(str(plan.draw(what, out or what.with_suffix(".png"))))
        return
    chosen = [name for name in kinds.split(",") if name]
    for path in import_module(f"{__package__}.from_above").sheet(what, range(seeds), chosen):
        typer.echo(str(path))


@roads_command.command("write")
def write_command(
    kind: str = typer.Argument(help="name of a kind of road (`isethdr roads list`)"),
    file: Path = typer.Argument(help="OpenDRIVE file to write (.xodr)"),
    seed: int = typer.Option(0, min=0, help="seed of the road"),
) -> None:
    """Write a kind of road as an OpenDRIVE file."""
    base = import_module(f"{ROADS}.kinds").kind(kind, seed)
    of = import_module(f"{ROADS}.opendrive.file_road").file_of(base)
    import_module(f"{ROADS}.opendrive.road_file").write(of, file)
    typer.echo(str(file))


@roads_command.command("check", short_help="Check an OpenDRIVE file.")
def check_command(
    file: Path = typer.Argument(help="OpenDRIVE file (.xodr)"),
) -> None:
    """Check an OpenDRIVE file: lengths, lanes, junctions, gaps, and contents that are left out."""
    for line in import_module(f"{__package__}.file_plan").report(file):
        typer.echo(line)


@roads_command.command("import-osm", short_help="Convert an OpenStreetMap file to OpenDRIVE.")
def import_osm_command(
    osm: Path = typer.Argument(help="OpenStreetMap file (.osm)"),
    out: Path = typer.Argument(help="OpenDRIVE file to write (.xodr)"),
) -> None:
    """Convert an OpenStreetMap file to OpenDRIVE, by SUMO's netconvert (extra traffic)."""
    import_module(f"{ROADS}.opendrive.openstreetmap").convert(osm, out)
    for line in import_module(f"{__package__}.file_plan").report(out):
        typer.echo(line)


@roads_command.command("net", short_help="Write the SUMO net of a road, for routes.")
def net_command(
    road: str = typer.Argument(help="name of a kind of road, or OpenDRIVE file (.xodr)"),
    file: Path = typer.Argument(help="net of SUMO to write (.net.xml)"),
    seed: int = typer.Option(0, min=0, help="seed of a kind of road"),
) -> None:
    """Write the net of SUMO on which routes for a road are made (extra traffic)."""
    path = Path(road)
    if path.suffix == ".xodr":
        network = import_module(f"{ROADS}.opendrive.file_road").content(path).network
    else:
        network = import_module(f"{ROADS}.kinds").kind(road, seed).network
    traffic = import_module(f"{ROADS.rpartition('.')[0]}.traffic.sumo.net")
    content = traffic.net_of(network).content
    try:
        file.write_bytes(content)
    except OSError as error:
        raise CatalogError(
            f"{file} cannot be written ({error.strerror}); type another path"
        ) from None
    typer.echo(str(file))
