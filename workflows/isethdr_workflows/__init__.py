"""Workflows: experiments ready to run, `isethdr run experiment=<name>`, and studies, `isethdr study <name>`.

| file                          | what                                                          |
|-------------------------------|---------------------------------------------------------------|
| `conf/experiment/night_drive` | the main job: a night drive through three cameras             |
| `conf/experiment/tunnel_exit` | the inside of a tunnel and its bright exit                    |
| `conf/experiment/five_lights` | five discs, each ten times dimmer, through a dusty aperture   |
| `study_command`               | the command `isethdr study`                                   |
| `published_figures`           | sensors against figures that others published                 |
| `emva1288`                    | every sensor measured by the machine vision standard          |
| `emva1288_camera`             | a simulated camera on the standard's bench                    |
| `emva1288_estimates`          | the standard's estimates, each with its standard error        |
| `merge_rules`                 | merge rules over eight decades of light                       |
| `demosaic_methods`            | demosaic methods on charts: PSNR and colour difference        |
| `paper_fig4`                  | flare by blades and dirt: a table and a sheet of pictures     |
| `stability`                   | every stage through hard cases, each with a verdict           |
| `convolution_methods`         | convolution methods: error against run time beside lamps      |
"""

from __future__ import annotations

from isethdr_core.hookspecs import hookimpl

STUDIES = {  # name: "module:function" in this package; a function takes its settings by name and returns rows, list[dict]
    "published_figures": "published_figures:published_figures",
    "emva1288": "emva1288:emva1288",
    "merge_rules": "merge_rules:merge_rules",
    "demosaic_methods": "demosaic_methods:demosaic_methods",
    "paper_fig4": "paper_fig4:paper_fig4",
    "stability": "stability:stability",
    "convolution_methods": "convolution_methods:convolution_methods",
}


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_workflows.conf"]


@hookimpl
def isethdr_commands(app):
    from .study_command import study

    app.command("study")(study)
