"""Output of `isethdr run --help`: what to type, for newcomers."""

from __future__ import annotations

from ..config.main_config import default_choices, settings
from ..plugins.component import KINDS
from ..plugins.presets import EXPERIMENT, presets
from .terminal import print_text

HEAD = """\
Usage: isethdr run [-m] [KIND=NAME] [KIND.FIELD=VALUE] [SETTING=VALUE] ...

Run the chain once, from the scene to the scores:

  scene -> renderer -> lighting -> lens (+ flare) -> sensor -> isp -> metric

`isethdr run` alone is the main job: a night drive, imaged by three cameras.
Each word behind `run` changes one thing of it.

Examples
  a colour chart, which needs no renderer; less than a minute
    isethdr run scene=macbeth lighting=ideal ~renderer ~flare.dirt \\
        scene.width=160 scene.height=90 sensor=bayer
  the same with another exposure time
    ... sensor.exposure_s=0.004
  a sweep: every combination of the values between commas
    isethdr run -m name=exposures ... sensor=bayer,rgbw \\
        sensor.exposure_s=0.004,0.016
  a whole experiment
    isethdr run experiment=night_rural

What to type
  KIND=NAME          choose a component or a preset
  KIND.FIELD=VALUE   set a field of the chosen component
  ~KIND              leave something out: ~renderer, ~flare.dirt, ~metric.ssim
  +KIND@KIND.KEY=NAME  add one more: +metric@metric.pu21=ssim_pu21
"""
TAIL = """\
Options
  -m, --multirun     sweep: run every combination of values between commas
  --home PATH        store below PATH, not below ISETHDR_HOME or ./runs
  --cfg job          print the whole config and run nothing
  --hydra-help       options of Hydra, which composes the config
  --help             this page

  isethdr plugins              every component and preset
  isethdr plugins sensor bayer   its fields: meaning, unit, default, range
  isethdr plan ...             what a run would compute, and for how long
"""


def print_run_help() -> None:
    """Print how to run, the kinds with their defaults, the experiments, and the settings."""
    print(HEAD)
    print("Kinds, and what the main job chooses")
    chosen = default_choices()
    for kind in KINDS:
        names = [name for group, name in chosen.items() if group.partition("@")[0] == kind]
        if kind == "lighting":  # the other lightings are versions that the report shows
            names = names[:1]
        print_text(f"{kind:<10} {', '.join(names)}", "  ", 13 * " ")
    print("\nExperiments, chosen with experiment=NAME")
    for experiment in presets(EXPERIMENT).values():
        print(f"  {experiment.name}")
        print_text(experiment.summary, "      ")
    print("\nSettings, with their defaults")
    for setting in settings():
        print(f"  {setting.name}={setting.default}")
        if setting.meaning:
            print_text(setting.meaning, "      ")
    print(f"\n{TAIL}", end="")
