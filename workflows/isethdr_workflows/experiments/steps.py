"""The steps of the experiments: commands, files that they make, expected minutes.

A command continues where it stopped, so an interrupted step is typed again. Expected minutes are
for two cores of a slow machine; `basis` says what was measured. The fast machine has two virtual
cores of an AMD EPYC of family 26 with AVX-512, and ran all steps once, beside light other work
(2026-11-29). The slow ones have cores of a third to half of that speed, and ran other work as well.
"""

from __future__ import annotations

from dataclasses import dataclass

from isethdr_core.errors import ConfigError, did_you_mean

DATASET = "streets"
LONGEST_MIN = 40.0  # time limit of a step
GENERATE = (
    f"dataset generate {DATASET} recipe=streets count=40 seed=1 renderer.width=480"
    " renderer.height=270 renderer.step_nm=20 renderer.most_samples=256"
    " engine=processes workers=2"
)
CROP = "cameras.bayer.rows=288 cameras.bayer.columns=512"
FOLDER = "experiments"  # folder for pictures, tables and records in the home folder
# a small dataset: eight roads towards a low sun, also lit as by night with dipped beams
SMALL = "low_sun"
LOW_SUN = (
    f"dataset generate {SMALL} recipe=low_sun count=8 seed=1 renderer.width=96 renderer.height=54"
    " renderer.step_nm=50 renderer.samples=64 scene.horizontal_field_deg=40"
)
SIX = "bayer,split_pixel,rgbw,split_pixel_imx490,bayer_imx363,single_ar0132at_rccc"
NETWORKS = " ".join(
    f"{filters}={{home}}/training/pictures/network_{name}/model.onnx"
    for filters, name in (("rgb", "bayer"), ("rgbw", "rgbw"))
)


@dataclass(frozen=True)
class Step:
    """One step.

    Parameters
    ----------
    name : name that a user types.
    about : purpose of the step.
    commands : commands of `isethdr`, in order; {home} stands for the home folder.
    makes : files in the home folder that exist when it is finished.
    minutes : expected minutes.
    basis : how the expected minutes were derived.
    needs : library that must be installed, and the extra that brings it; ("", "") for none.
    """

    name: str
    about: str
    commands: tuple[str, ...]
    makes: tuple[str, ...]
    minutes: float
    basis: str
    needs: tuple[str, str] = ("", "")


def measured(fast: str, slow: str) -> str:
    """Return the basis of expected minutes that were measured.

    Parameters
    ----------
    fast, slow : minutes on the fast machine, and on slow ones.
    """
    return f"measured: {fast} min on a fast machine, {slow} on a slow one"


def network(sensor: str) -> Step:
    """Return the step that trains a network for the pictures of a sensor, and compares it with
    classical development on roads that were not in the training.
    """
    name = f"network_{sensor.removeprefix('typical_')}"
    model = f"training/pictures/{name}/model.onnx"
    table = f"{FOLDER}/{name}.csv"
    return Step(
        name,
        f"a network of at most half a million parameters for {sensor}, against classical"
        " development",
        (
            f"train picture sensor={sensor} dataset={DATASET} size=small minutes=10 threads=2"
            " patch_px=96 pictures=240"
            f" name={name}",
            f"study learned_picture sensor={sensor} dataset={DATASET} model={{home}}/{model}"
            f" --csv {{home}}/{table}",
        ),
        (model, table),
        18.5,
        measured("13.0", "22.3 to 22.8") + ", there with 14 min of training in place of 10",
        ("torch", "train"),
    )


def question(name: str, about: str, minutes: float, basis: str) -> Step:
    """Return the step of a question of the study detection.

    Parameters
    ----------
    name : name of the question.
    about : what it answers, as text for readers.
    minutes : expected minutes on two cores.
    basis : how this number was derived.
    """
    return Step(
        f"detection_{name}",
        about,
        (f"study detection dataset={DATASET} question={name}",),
        (f"datasets/{DATASET}/detection_{name}.md",),
        minutes,
        basis,
    )


STEPS = (
    Step(
        "dataset_first",
        "the first 20 of 40 streets, 480 x 270 tiles, 16 bands",
        (f"{GENERATE} sample=20",),
        (f"datasets/{DATASET}/scenes/00019.json",),
        22.0,
        measured("6.7", "20.9 to 26.9"),
    ),
    Step(
        "dataset",
        "all 40 streets, their page, card and parts",
        (
            GENERATE,
            *(f"dataset {what} {DATASET}" for what in ("splits", "describe", "report")),
        ),
        (f"datasets/{DATASET}/scenes/00039.json", f"datasets/{DATASET}/splits.json"),
        24.0,
        measured("8.8", "26.3 to 27.5"),
    ),
    network("typical_bayer"),
    network("typical_rgbw"),
    Step(
        "filters_networks",
        "figures 8 and 9 of the paper with the two networks, on roads outside their training",
        (
            f"study paper_fig8_9_networks dataset={DATASET} {NETWORKS}"
            f" picture={{home}}/{FOLDER}/fig8_9.jpg --csv {{home}}/{FOLDER}/filters_networks.csv",
        ),
        (f"{FOLDER}/filters_networks.csv", f"{FOLDER}/fig8_9.jpg"),
        0.3,
        measured("0.1", "0.3"),
        ("torch", "train"),
    ),
    Step(
        "detector",
        "a small detector for all cameras, and what it finds on roads outside its training",
        (
            f"train detector dataset={DATASET} minutes=10 lightings=recipe realisations=1"
            " threads=2 patience=4 name=all_cameras",
            f"study detector_scores dataset={DATASET} part=test draws=1"
            " detector={home}/training/detectors/all_cameras/detector.yaml",
        ),
        ("training/detectors/all_cameras/detector.onnx", f"datasets/{DATASET}/detector_scores.csv"),
        22.0,
        measured("8.8", "22.4"),
        ("torch", "train"),
    ),
    Step(
        "detection",
        "which objects each camera could find",
        (f"study detection dataset={DATASET}",),
        (f"datasets/{DATASET}/detection.md",),
        4.5,
        measured("1.7", "4.5"),
    ),
    question(
        "captures",
        "one capture of the split pixel against three",
        1.5,
        measured("0.6", "1.5"),
    ),
    question(
        "filters",
        "RGB against RGBW and RCCB, 0.003 to 100 lx",
        6.4,
        measured("2.8", "6.4"),
    ),
    Step(
        "detection_dark",
        "how dark it may get before a person is lost, for six sensors",
        (f"study detection dataset={DATASET} question=dark cameras={SIX}",),
        (f"datasets/{DATASET}/detection_dark.md",),
        5.6,
        measured("2.0", "5.6"),
    ),
    question(
        "noise",
        "whether the renderer's noise changes which objects are found",
        2.2,
        measured("0.7", "2.2"),
    ),
    Step(
        "low_sun",
        "eight small roads towards a low sun: one capture of the split pixel against three, and,"
        " under night light, all bundled presets of sensors",
        (
            LOW_SUN,
            f"dataset splits {SMALL}",
            f"study detection dataset={SMALL} question=captures",
            f"study detection dataset={SMALL} question=dark",
        ),
        tuple(f"datasets/{SMALL}/detection_{name}.md" for name in ("captures", "dark")),
        8.5,
        measured("2.9", "8.6"),
    ),
    Step(
        "filters_rccb",
        "classical development and the colour matrix alone with RCCB filters, on the small roads",
        (
            f"study learned_picture sensor=typical_bayer sensor.cfa=RCCB dataset={SMALL}"
            f" files={{home}}/{FOLDER}/rccb --csv {{home}}/{FOLDER}/filters_rccb.csv",
        ),
        (f"{FOLDER}/filters_rccb.csv",),
        1.8,
        measured("0.7", "1.8"),
    ),
    Step(
        "picture_noise",
        "whether the renderer's noise changes the gain of networks and of RGBW filters, on the"
        " small roads",
        (
            f"study picture_noise dataset={SMALL} part=all {NETWORKS}"
            f" --csv {{home}}/{FOLDER}/picture_noise.csv",
        ),
        (f"{FOLDER}/picture_noise.csv",),
        3.4,
        measured("1.4", "3.4"),
        ("torch", "train"),
    ),
    Step(
        "dirt",
        "shares of scatter, ghosts and noise in the loss that a dirty lens causes",
        (
            f"study dirt dataset={DATASET} cameras=bayer scenes=20 {CROP}"
            f" page={{home}}/{FOLDER}/dirt.md --csv {{home}}/{FOLDER}/dirt.csv",
        ),
        (f"{FOLDER}/dirt.md",),
        5.0,
        measured("1.4", "5.1"),
    ),
    Step(
        "render_noise",
        "whether the renderer's noise or its denoiser changes the result of the step dirt",
        (
            f"study render_noise dataset={DATASET} cameras=bayer scenes=5 {CROP}"
            f" page={{home}}/{FOLDER}/render_noise.md",
        ),
        (f"{FOLDER}/render_noise.md",),
        4.0,
        measured("1.3", "5.3"),
    ),
    Step(
        "figures",
        "figures 1, 2 and 4 of the paper",
        (
            f"study paper_fig1 store={DATASET} picture={{home}}/{FOLDER}/fig1.jpg",
            f"study paper_fig2 picture={{home}}/{FOLDER}/fig2.jpg",
            f"study paper_fig4 picture={{home}}/{FOLDER}/fig4.jpg",
        ),
        tuple(f"{FOLDER}/fig{number}.jpg" for number in (1, 2, 4)),
        1.8,
        measured("0.5", "1.8"),
    ),
    Step(
        "results",
        "the tables of all steps on one page",
        ("experiments results",),
        (f"{FOLDER}/results.md",),
        0.1,
        "reads and writes text",
    ),
)


def steps_named(names: tuple[str, ...]) -> tuple[Step, ...]:
    """Return the steps with some names, in the order of `STEPS`; all steps if no name is given.

    Raises
    ------
    ConfigError : there is no step of such a name.
    """
    known = {step.name: step for step in STEPS}
    for name in names:
        if name not in known:
            raise ConfigError(f"there is no step {name!r}{did_you_mean(name, known)}")
    return tuple(step for step in STEPS if not names or step.name in names)
