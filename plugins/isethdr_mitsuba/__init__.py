"""isethdr_mitsuba: turns a scene description into scene radiance with Mitsuba 3.

| module     | content                                                                        |
|------------|--------------------------------------------------------------------------------|
| `bands`    | bands that something has no data for are refused                                |
| `doctor`   | which Mitsuba variants work on this machine, found out in a child process      |
| `frame`    | world, passes, lamps seen directly, labels, and the Dataset made of them       |
| `labels`   | labels by one ray through each tile's centre: exact, and all from the same hit |
| `llvm`     | where LLVM is taken from                                                       |
| `renderer` | the renderer `mitsuba`                                                         |
| `conf/`    | presets                                                                        |
| `lamps/`   | from candela to radiance, and which lamp a path looks for                      |
| `paths/`   | the integrator, its passes, and the tables that it reads on the device         |
| `world/`   | a scene description as Mitsuba objects, and the camera's grid of tiles         |
"""

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

from .doctor import doctor_command

COMPONENTS = [
    Component("renderer", "mitsuba", "isethdr_mitsuba.renderer:MitsubaRenderer"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components():
    return COMPONENTS


@hookimpl
def isethdr_commands(app):
    app.command("doctor")(doctor_command)


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_mitsuba.conf"]
