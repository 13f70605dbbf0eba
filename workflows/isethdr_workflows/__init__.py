"""Workflows: experiments, `isethdr run experiment=<name>`, and studies, `isethdr study <name>`.

| module          | what                                                                        |
|-----------------|-----------------------------------------------------------------------------|
| `empty_home`    | a study's own folder for stores and kernels                                 |
| `preview`       | a first look at a scene: few samples, denoised                              |
| `study_command` | the command `isethdr study`                                                 |
| `accuracy/`     | error against run time of every stage that has a knob                       |
| `budget/`       | whether the error allowed is kept                                           |
| `conf/`         | presets                                                                     |
| `emva1288/`     | simulated cameras measured by the machine vision standard                   |
| `isp/`          | merge rules, demosaic methods, and training of the learned demosaic         |
| `omission/`     | runs that leave out what they do not need, against runs that do not         |
| `optics/`       | convolution methods, coloured streaks and ghosts                            |
| `paper/`        | the figures of the ISETHDR paper, computed again                            |
| `sensors/`      | studies of sensors over many decades of light and against published figures |
| `stability/`    | every stage and the whole chain through hard cases                          |
"""

from __future__ import annotations

from isethdr_core.hookspecs import hookimpl

# name: "module:function" in this package; a function takes its settings by name and returns rows,
# list[dict]
STUDIES = {
    "published_figures": "sensors.published_figures:published_figures",
    "emva1288": "emva1288.study:emva1288",
    "level_curves": "sensors.level_curves:level_curves",
    "merge_rules": "isp.merge_rules:merge_rules",
    "demosaic_methods": "isp.demosaic_methods:demosaic_methods",
    "train_demosaic": "isp.train_demosaic:train_demosaic",
    "paper_fig4": "paper.fig4:paper_fig4",
    "paper_fig3": "paper.fig3:paper_fig3",
    "paper_fig5": "paper.fig5:paper_fig5",
    "paper_fig8_9_classical": "paper.fig8_9:paper_fig8_9_classical",
    "paper_fig6_7": "paper.fig6_7:paper_fig6_7",
    "ghosts_night": "optics.ghosts_night:ghosts_night",
    "led_flicker": "sensors.led_flicker:led_flicker",
    "coloured_streaks": "optics.coloured_streaks:coloured_streaks",
    "stability": "stability:stability",
    "accuracy": "accuracy:accuracy",
    "budget": "budget:budget",
    "omission": "omission:omission",
    "convolution_methods": "optics.convolution_methods:convolution_methods",
    "preview": "preview:preview",
}


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_workflows.conf"]


@hookimpl
def isethdr_commands(app):
    from .study_command import study

    app.command("study")(study)
