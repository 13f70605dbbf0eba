"""Workflows: experiments ready to run, `isethdr run experiment=<name>`.

| file                          | what                                                          |
|-------------------------------|---------------------------------------------------------------|
| `conf/experiment/night_drive` | the main job: a night drive through three cameras             |
| `conf/experiment/tunnel_exit` | the inside of a tunnel and its bright exit                    |
| `conf/experiment/five_lights` | five discs, each ten times dimmer, through a dusty aperture   |
"""

from __future__ import annotations

from isethdr_core.hookspecs import hookimpl


@hookimpl
def isethdr_config_paths():
    """Return the folder with the experiments."""
    return ["pkg://isethdr_workflows.conf"]
