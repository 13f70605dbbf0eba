"""Export: the trained detector as an ONNX file, its `detector.yaml`, and its model card."""

from __future__ import annotations

import hashlib
import logging
import math
import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import open_session
from isethdr_core.runs.provenance import versions

from ...detectors.bootstrap import SHARE, estimate
from ...detectors.classes import CLASSES
from ...detectors.description import DetectorForm, InputForm, OutputForm, written
from ...detectors.detector import Detector, open_detector
from ...detectors.groups import EVERYTHING
from ...detectors.matching import Picture
from ...detectors.objects import LEAST_HEIGHT_PX, TruthObject
from ...detectors.tables import ALL, NAMES, Answers, Compared
from ..card import write_card
from ..files import write_file
from ..onnx_notes import remove_notes
from ..torch_library import hardware, onnx, torch
from .network import Boxes, DetectorNetwork, parameters_of
from .pictures import LEAST_HEIGHT_PX as LEAST_SHRUNK_PX
from .pictures import LabelledPicture
from .settings import STRIDE_PX
from .training import Trained

MODEL = "detector.onnx"
DESCRIPTION = "detector.yaml"
# largest difference from PyTorch over the largest value; float32 sums have another order
AGREEMENT = 1e-4
COMMON = 0.9  # least share of the peaks that both outputs have
LARGEST_CELLS = 512  # largest rows and columns of a picture over STRIDE_PX
# factor on boxes for the scores of held-out pictures; 2 is for rounding
ENLARGED = 2 * LEAST_HEIGHT_PX / LEAST_SHRUNK_PX
NOISY = ("torch.onnx", "torch.utils.flop_counter")  # loggers of the exporter that are silenced


def exported(run: Trained, recipe: str) -> Detector:
    """Write ONNX file, description and card of a training, and return the detector.

    Parameters
    ----------
    run : finished training.
    recipe : text of the recipe.

    Raises
    ------
    ConfigError : the file computes other values than the network.
    CatalogError : a file cannot be written.
    """
    network = DetectorNetwork(run.settings.size)
    network.load_state_dict(run.progress.best["weights"])
    network.eval()
    path = run.folder / MODEL
    write_onnx(network, path)
    worst = difference(network, path)
    if not worst <= AGREEMENT:
        raise ConfigError(
            f"{path} differs from the trained network by {worst:.1e} of the largest value;"
            f" expected at most {AGREEMENT:g}; train again with other versions of torch and"
            " onnxruntime"
        )
    description = run.folder / DESCRIPTION
    write_file(description, [written(form_of(run)).encode()])
    detector = open_detector(description)
    write_card(run.folder, "Detector", card_of(run, detector, network, recipe))
    return detector


def write_onnx(network: DetectorNetwork, path: Path) -> None:
    """Write the network with its boxes as an ONNX file. It accepts pictures of different sizes.

    Parameters
    ----------
    network : trained network.
    path : file to write.
    """
    sizes = {
        2: torch.export.Dim("rows", min=2, max=LARGEST_CELLS) * STRIDE_PX,
        3: torch.export.Dim("columns", min=2, max=LARGEST_CELLS) * STRIDE_PX,
    }
    levels = {name: logging.getLogger(name).level for name in NOISY}
    for name in NOISY:
        logging.getLogger(name).setLevel(logging.ERROR)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = Path(folder) / MODEL
        torch.onnx.export(
            Boxes(network).eval(),
            (torch.zeros(1, 3, 6 * STRIDE_PX, 4 * STRIDE_PX),),
            file,
            dynamo=True,
            external_data=False,
            verbose=False,
            input_names=["picture"],
            output_names=["boxes", "scores"],
            dynamic_shapes=(sizes,),
        )
        model = onnx.load(file)
    remove_notes(model)
    for name, before in levels.items():
        logging.getLogger(name).setLevel(before)
    write_file(path, [model.SerializeToString()])


@torch.no_grad()
def difference(network: DetectorNetwork, path: Path) -> float:
    """Return the largest difference between the outputs of a file and of PyTorch, over the largest
    value, for a picture with another size than the exported one.

    Scores are compared at the peaks that both outputs have, because rounding may add or remove a
    peak. The result is infinite if they share fewer than `COMMON` of them.

    Parameters
    ----------
    network : network in PyTorch.
    path : ONNX file of the network.
    """
    random = np.random.default_rng(1)
    rgb = random.random((1, 3, 3 * STRIDE_PX, 8 * STRIDE_PX), np.float32)
    theirs = open_session(path, "isethdr train detector").run({"picture": rgb})
    boxes, scores = (v.numpy() for v in Boxes(network).eval()(torch.from_numpy(rgb)))
    common = (theirs["scores"] > 0) & (scores > 0)
    either = (theirs["scores"] > 0) | (scores > 0)
    if common.sum() < COMMON * either.sum():
        return math.inf
    of_boxes = np.abs(theirs["boxes"] - boxes).max() / np.abs(boxes).max()
    of_scores = np.abs(theirs["scores"] - scores)[common].max() / scores.max()
    return float(max(of_boxes, of_scores))


def form_of(run: Trained) -> DetectorForm:
    """Return the description of the exported detector. Its input is as wide as the widest picture
    of the training, so that objects have the sizes of the training.
    """
    shapes = {p.rgb.shape[:2] for p in (*run.data.training, *run.data.held_out)}
    widest = max(columns for _, columns in shapes)
    width = min(run.settings.input_px, -(-widest // STRIDE_PX) * STRIDE_PX)
    tallest = max(-(-rows * width // (columns * STRIDE_PX)) for rows, columns in shapes)
    return DetectorForm(
        model=MODEL,
        about=f"trained by isethdr train detector; {run.data.about}",
        input=InputForm(size_px=(width, tallest * STRIDE_PX)),
        output=OutputForm(form="apart"),
        classes=dict(enumerate(CLASSES)),
        trained_roads=tuple(run.data.roads),
    )


def card_of(
    run: Trained, detector: Detector, network: DetectorNetwork, recipe: str
) -> dict[str, Any]:
    """Return the sections of the model card.

    Parameters
    ----------
    run : finished training.
    detector : exported detector, for its scores on held-out roads.
    network : network of the detector.
    recipe : text of the recipe; its hash is stated.
    """
    progress = run.progress
    return {
        "about": (
            "A small anchor-free detector, trained from nothing on simulated pictures. No weights"
            " and no pictures of others were used. It is a means of comparing cameras, not a"
            " detector to drive by."
        ),
        "network": {
            "size": run.settings.size,
            "parameters": parameters_of(network),
            "classes": list(CLASSES),
        },
        "data": run.data.about or "pictures given by a program",
        "training": {
            "steps": progress.clock.step,
            "minutes": round(progress.clock.seconds() / 60, 1),
            "weights": f"of step {progress.best['step']}, the best check of the held-out pictures",
            "loss": "focal loss of centres, overlap and logarithms of the sides of boxes",
            "optimiser": "AdamW, linear rise and cosine fall of the rate",
            "stopped": progress.stopped or "at its length",
            "hardware": hardware(run.device),
        },
        "settings": {k: str(v) for k, v in vars(run.settings).items()},
        "recipe": hashlib.sha256(recipe.encode()).hexdigest(),
        "held_out": held_out_rows(detector, run.data.held_out),
        "roads": list(run.data.roads),
        "versions": {k: str(v) for k, v in versions().items()},
        "limits": (
            "The held-out roads decided when to stop, so scores on them are a little too good."
            " Score it on other roads: isethdr study detector_scores leaves out the roads above."
        ),
    }


def held_out_rows(detector: Detector, pictures: Sequence[LabelledPicture]) -> list[dict[str, Any]]:
    """Return the scores on held-out pictures as text, with 95 % intervals over roads.

    Parameters
    ----------
    detector : exported detector.
    pictures : held-out pictures.
    """
    shown = []
    for number, one in enumerate(pictures):
        found = detector.in_displayed(one.rgb.astype(np.float32) / 255)
        found = replace(found, boxes=ENLARGED * found.boxes)
        shown.append(Picture(number, one.road, "all", objects_of(one), found))
    compared = Compared({"all": [Answers("all", shown)]}, CLASSES)
    drawn = compared.draws("all", EVERYTHING)
    rows = []
    for name in (ALL, *CLASSES):
        row: dict[str, Any] = {"class": name, "objects": compared.objects("all", name, EVERYTHING)}
        holding = compared.roads_with("all", name, EVERYTHING)
        for score in NAMES:
            found = estimate(drawn[name][score], holding, SHARE)
            known = math.isfinite(found.low)
            interval = f"{found.low:.3f} to {found.high:.3f}" if known else "no interval"
            row[score] = f"{found.value:.3f} ({interval})"
        rows.append(row)
    return rows


def objects_of(picture: LabelledPicture) -> list[TruthObject]:
    """Return the objects of a labelled picture. Objects that the detector need not find have a
    visible fraction of 0, so that they do not count.

    Boxes are enlarged, so that every object that should be found in the shrunk picture is high
    enough to count. Overlaps with boxes that are enlarged alike do not change.
    """
    return [
        TruthObject(
            instance=number,
            class_name=CLASSES[kind],
            category=CLASSES[kind],
            name="",
            box=tuple(map(float, ENLARGED * box)),
            distance_m=float("nan"),
            illuminance_lx=float("nan"),
            lamp_near=False,
            visible_fraction=float(asked),
            truncation=0.0,
        )
        for number, (box, kind, asked) in enumerate(
            zip(picture.boxes, picture.classes, picture.asked, strict=True), 1
        )
    ]
