"""isethdr_mitsuba: turns a scene description into scene radiance with Mitsuba 3.

| module        | content                                                                        |
|---------------|--------------------------------------------------------------------------------|
| `bands`       | an error for bands that a sky, lamp or material has no data for                |
| `doctor`      | tests in a child process which Mitsuba variants work on this machine           |
| `fog`         | fog: the uniform sky used with it, and the light that is left out              |
| `frame`       | one frame: world, passes, visible lamps, labels, and the Dataset               |
| `illuminance` | illuminance of each object by each light group, on a plane facing the camera   |
| `labels`      | labels by one ray through each tile's centre: exact, and all from the same hit |
| `llvm`        | finds the LLVM library                                                         |
| `motion`      | the label `motion`: displacement of each tile's point until the next frame     |
| `renderer`    | the renderer `mitsuba`                                                         |
| `conf/`       | presets                                                                        |
| `lamps/`      | from candela to radiance, and the sampling of lamps                            |
| `paths/`      | the integrator, its passes, and the tables that it reads on the device         |
| `world/`      | a scene description as Mitsuba objects, and the camera's grid of tiles         |
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

from .doctor import doctor_command

if TYPE_CHECKING:
    import typer


COMPONENTS = [
    Component("renderer", "mitsuba", "isethdr_mitsuba.renderer:MitsubaRenderer"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    return COMPONENTS


@hookimpl
def isethdr_commands(app: typer.Typer) -> None:
    app.command("doctor")(doctor_command)


@hookimpl
def isethdr_config_paths() -> list[str]:
    return ["pkg://isethdr_mitsuba.conf"]
