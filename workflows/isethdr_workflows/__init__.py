"""Workflows: experiments ready to run, `isethdr run experiment=<name>`, and studies, `isethdr study <name>`.

| file                          | what                                                          |
|-------------------------------|---------------------------------------------------------------|
| `conf/experiment/night_drive` | the main job: a night drive through three cameras             |
| `conf/experiment/tunnel_exit` | the inside of a tunnel and its bright exit                    |
| `conf/experiment/five_lights` | five discs, each ten times dimmer, through a dusty aperture   |
| `study_command`               | the command `isethdr study`                                   |
| `published_figures`           | sensors against figures that others published                 |
| `published_lofic`             | a LOFIC pixel against the title of its paper                  |
| `emva1288`                    | every sensor measured by the machine vision standard          |
| `emva1288_camera`             | a simulated camera on the standard's bench                    |
| `emva1288_dark`               | as many dark pictures as its pattern asks for                 |
| `emva1288_estimates`          | the standard's estimates, each with its standard error        |
| `emva1288_general`            | its general model: companded codes, soft knees                |
| `level_curves`                | SNR and contrast detection of a sensor over eight decades     |
| `merge_rules`                 | merge rules over eight decades of light                       |
| `demosaic_methods`            | demosaic methods on charts: PSNR and colour difference        |
| `train_demosaic`              | filters of the learned demosaic, from simulated pictures      |
| `dead_leaves`                 | procedural pictures to learn from                             |
| `paper_fig4`                  | flare by blades and dirt: a table and a sheet of pictures     |
| `paper_scene`                 | what the paper's figures share: a rendered scene, sheets      |
| `paper_fig3`                  | one rendering by day and by night, a line through a headlight |
| `paper_fig5`                  | exposures of a phone camera at night, with growing flare      |
| `paper_fig6_7`                | split pixel in a tunnel and beside headlights                 |
| `paper_fig8_9`                | RGB against RGBW, SSIM and colour error against illuminance   |
| `ghosts_night`                | ghosts of a night drive's lamps, bare glass and coated        |
| `led_flicker`                 | LED lamps that short exposures miss, bands of rolling shutters |
| `led_flicker_figures`         | its two figures                                               |
| `coloured_streaks`            | dust around a lamp: bands of one wavelength and whole bands   |
| `stability`                   | every stage through hard cases, each with a verdict           |
| `accuracy`                    | error against run time of every stage that has a knob         |
| `budget`                      | the error allowed, on unseen scenes: is it kept, at what cost |
| `omission`                    | ten runs that leave out what they do not need, and do not     |
| `empty_home`                  | the folder that these two work in: no kernel is at hand there |
| `convolution_methods`         | convolution methods: error against run time beside lamps      |
| `preview`                     | a first look at a scene: few paths, denoised                  |
"""

from __future__ import annotations

from isethdr_core.hookspecs import hookimpl

STUDIES = {  # name: "module:function" in this package; a function takes its settings by name and returns rows, list[dict]
    "published_figures": "published_figures:published_figures",
    "emva1288": "emva1288:emva1288",
    "level_curves": "level_curves:level_curves",
    "merge_rules": "merge_rules:merge_rules",
    "demosaic_methods": "demosaic_methods:demosaic_methods",
    "train_demosaic": "train_demosaic:train_demosaic",
    "paper_fig4": "paper_fig4:paper_fig4",
    "paper_fig3": "paper_fig3:paper_fig3",
    "paper_fig5": "paper_fig5:paper_fig5",
    "paper_fig8_9_classical": "paper_fig8_9:paper_fig8_9_classical",
    "paper_fig6_7": "paper_fig6_7:paper_fig6_7",
    "ghosts_night": "ghosts_night:ghosts_night",
    "led_flicker": "led_flicker:led_flicker",
    "coloured_streaks": "coloured_streaks:coloured_streaks",
    "stability": "stability:stability",
    "accuracy": "accuracy:accuracy",
    "budget": "budget:budget",
    "omission": "omission:omission",
    "convolution_methods": "convolution_methods:convolution_methods",
    "preview": "preview:preview",
}


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_workflows.conf"]


@hookimpl
def isethdr_commands(app):
    from .study_command import study

    app.command("study")(study)
