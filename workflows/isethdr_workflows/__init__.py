"""Workflows: experiments, `isethdr run experiment=<name>`, and studies, `isethdr study <name>`.

| module          | content                                                                     |
|-----------------|-----------------------------------------------------------------------------|
| `empty_home`    | a study's own folder for stores and kernels                                 |
| `ghosts_night`  | ghosts of a night drive, with uncoated and with coated glass                |
| `html_template` | templates of the pages of datasets and studies                              |
| `markdown_table` | a table in Markdown                                                        |
| `preview`       | a first look at a scene: few samples, denoised                              |
| `study_command` | the command `isethdr study`                                                 |
| `accuracy/`     | error against run time of any configuration, by its accuracy knobs          |
| `conf/`         | presets                                                                     |
| `dataset/`      | datasets of rendered scenes, drawn from a recipe: `isethdr dataset`         |
| `detection/`    | which objects can be detected at all in the data of each camera             |
| `detectors/`    | detectors in ONNX files on pictures of runs, and their scores               |
| `export/`       | stored runs as files of other programs, `isethdr export`                    |
| `experiments/`  | the results of the findings page, computed again: `isethdr experiments`     |
| `emva1288/`     | simulated cameras measured by the machine vision standard                   |
| `isp/`          | training of the learned demosaic                                            |
| `paper/`        | the figures of the ISETHDR paper, computed again                            |
| `questions/`    | studies over a dataset that answer one question, with intervals             |
| `sequences/`    | frames with automatic exposure that settles, `isethdr sequence`             |
| `sensors/`      | studies of sensors over many decades of light and against published figures |
| `training/`     | networks trained on simulated data, `isethdr train`                         |
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.hookspecs import hookimpl

from .dataset.command import app as dataset
from .experiments.command import app as experiments
from .sequences.command import HELP as SEQUENCE
from .sequences.command import sequence
from .training.command import app as train

if TYPE_CHECKING:
    import typer


# {name: "module:function" in this package}; a function takes its settings by name and returns rows,
# list[dict]
STUDIES = {
    "accuracy": "accuracy:accuracy",
    "detection": "detection.study:detection",
    "published_figures": "sensors.published_figures:published_figures",
    "emva1288": "emva1288.study:emva1288",
    "level_curves": "sensors.level_curves:level_curves",
    "train_demosaic": "isp.train_demosaic:train_demosaic",
    "paper_fig1": "paper.fig1:paper_fig1",
    "paper_fig2": "paper.fig2:paper_fig2",
    "paper_fig4": "paper.fig4:paper_fig4",
    "paper_fig3": "paper.fig3:paper_fig3",
    "paper_fig5": "paper.fig5:paper_fig5",
    "paper_fig8_9_classical": "paper.fig8_9:paper_fig8_9_classical",
    "paper_fig8_9_networks": "paper.fig8_9_networks:paper_fig8_9_networks",
    "paper_fig6_7": "paper.fig6_7:paper_fig6_7",
    "ghosts_night": "ghosts_night:ghosts_night",
    "led_flicker": "sensors.led_flicker:led_flicker",
    "preview": "preview:preview",
    "learned_picture": "training.learned_picture:learned_picture",
    "dirt": "questions.dirt:dirt",
    "render_noise": "questions.render_noise:render_noise",
    "picture_noise": "questions.picture_noise:picture_noise",
    "detector_scores": "detectors.study:detector_scores",
}
# {name: "module:function"} of the studies for which a terminal shows a summary; the file of rows
# holds everything
SHOWN = {
    "accuracy": "accuracy.summary:by_knob",
    "detection": "questions.tables:for_people",
    "detector_scores": "detectors.study:of_everything",
    "dirt": "questions.tables:for_people",
    "render_noise": "questions.tables:for_people",
    "picture_noise": "questions.tables:for_people",
}


@hookimpl
def isethdr_config_paths() -> list[str]:
    return ["pkg://isethdr_workflows.conf"]


@hookimpl
def isethdr_commands(app: typer.Typer) -> None:
    from .export.command import HELP, export
    from .study_command import study

    app.command("study")(study)
    app.add_typer(dataset, name="dataset")
    app.add_typer(experiments, name="experiments")
    app.add_typer(train, name="train")
    app.command("export", help=HELP, short_help="Write stored runs as files of other programs.")(
        export
    )
    app.command("sequence", help=SEQUENCE, short_help="Run the frames of a scene that moves.")(
        sequence
    )
