"""A detector: its description, its network, and its detections in pictures of runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.onnx_session import OnnxSession, Port, open_session, shape_text

from .boxes import Detections, suppressed
from .classes import CLASSES
from .description import DetectorForm, read_description
from .outputs import COUNT, Reader
from .picture_input import View, displayed, fit_of, network_input

if TYPE_CHECKING:
    import xarray as xr

CHANNELS = 3


@dataclass(frozen=True)
class Detector:
    """A detector that is ready to use; `open_detector` makes it."""

    path: Path  # path of the description
    form: DetectorForm
    session: OnnxSession
    port: Port  # the network's input
    reader: Reader

    def __call__(self, picture: xr.Dataset, view: View) -> Detections:
        """Return the detections in a picture.

        Parameters
        ----------
        picture : picture of a run: xyz in cd/m2, valid.
        view : white and curve with which the run is shown.
        """
        return self.in_displayed(displayed(picture, view, self.form.input.tone))

    def in_displayed(self, rgb: np.ndarray) -> Detections:
        """Return the detections in a displayed picture (y, x, 3), 0 to 1.

        Boxes are cut at the frame. Boxes outside the frame are left out.

        Raises
        ------
        ConfigError : the picture does not fit the network's input, or an output has another shape
            than in the description.
        """
        height, width = rgb.shape[:2]
        fit = fit_of(width, height, self.form.input)
        self._check_input(fit.size_px)
        array = network_input(rgb, fit, self.form.input)
        outputs = self.session.run({self.port.name: array})
        select = self.form.select
        found = self.reader(outputs, fit.size_px, select.least_score)
        boxes = np.clip(fit.back(found.boxes), 0, [width, height, width, height])
        inside = (boxes[:, 2:] > boxes[:, :2]).all(1)
        place = {number: CLASSES.index(name) for number, name in self.form.classes.items()}
        classes = np.array([place[int(n)] for n in found.numbers[inside]], int)
        detections = Detections(boxes[inside], found.scores[inside], classes)
        return suppressed(detections, select.overlap, select.most)

    def _check_input(self, size_px: tuple[int, int]) -> None:
        wanted = _input_shape(self.form, size_px)
        have = self.port.shape
        fits = len(have) == len(wanted) and all(
            fixed in (None, size) for fixed, size in zip(have, wanted, strict=True)
        )
        if not fits:
            hint = "input.layout and input.channels"
            if self.form.input.size_px is None or _sizes(self.form, have) != size_px:
                size = _sizes(self.form, have)
                hint = f"input.size_px: [{size[0]}, {size[1]}]" if all(size) else "input.size_px"
            raise ConfigError(
                f"the input {self.port.name!r} of {self.session.path} has the shape"
                f" {shape_text(have)}; {self.path.name} gives it {shape_text(wanted)}; type for"
                f" example {hint}"
            )


def open_detector(path: Path) -> Detector:
    """Load a detector, and try it once on a black picture.

    Parameters
    ----------
    path : path of the detector's description, a YAML file.

    Raises
    ------
    ConfigError : the description or the ONNX file is missing, damaged or wrong, they do not fit
        together, or onnxruntime is not installed.
    """
    form = read_description(path)
    session = open_session(path.parent / form.model, f"the detector {path.name}")
    inputs = {port.name: port for port in session.inputs}
    name = form.input.name or next(iter(inputs))
    if name not in inputs or len(inputs) > 1:
        raise ConfigError(
            f"{session.path} has the inputs {', '.join(inputs)}; expected one,"
            f" {name!r}{did_you_mean(name, inputs)}"
        )
    reader = Reader(str(session.path), form.output, _outputs(form, session), tuple(form.classes))
    detector = Detector(path, form, session, inputs[name], reader)
    # size_px, or the smallest picture that a network without a fixed size can read
    width, height = form.input.size_px or (form.input.multiple_px, form.input.multiple_px)
    if form.input.size_px is None and all(_sizes(form, detector.port.shape)):
        detector._check_input((width, height))
    detector.in_displayed(np.zeros((height, width, CHANNELS), np.float32))
    return detector


def _outputs(form: DetectorForm, session: OnnxSession) -> tuple[str, ...]:
    """Return the names of the outputs in the order of the form."""
    known = [port.name for port in session.outputs]
    count = COUNT[form.output.form]
    names = form.output.names or tuple(known[:count])
    for name in names:
        if name not in known:
            raise ConfigError(
                f"{session.path} has no output {name!r}{did_you_mean(name, known)}; see"
                " output.names in its description"
            )
    if len(names) != count:
        raise ConfigError(
            f"{session.path} has the outputs {', '.join(known)}; output.form: {form.output.form}"
            f" needs {count}; see output.names in its description"
        )
    return names


def _input_shape(form: DetectorForm, size_px: tuple[int, int]) -> tuple[int, ...]:
    width, height = size_px
    if form.input.layout == "nchw":
        return (1, CHANNELS, height, width)
    return (1, height, width, CHANNELS)


def _sizes(form: DetectorForm, shape: tuple[int | None, ...]) -> tuple[int | None, int | None]:
    """Return width and height of a network's input."""
    if len(shape) != 4:
        return None, None
    rows, columns = (2, 3) if form.input.layout == "nchw" else (1, 2)
    return shape[columns], shape[rows]
