"""From the outputs of a network to boxes, scores and numbers of classes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, softmax

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import shape_text

from .boxes import corners
from .description import OutputForm

COUNT = {"apart": 2, "joined": 1, "labelled": 3, "rows": 1}  # number of outputs of each form


@dataclass(frozen=True, eq=False)
class Candidates:
    """All boxes of a network for one picture, in its own classes.

    Parameters
    ----------
    boxes : (n, 4) left, top, right, bottom in pixels of the input.
    scores : (n,) scores of the boxes.
    numbers : (n,) numbers of the classes in the network.
    """

    boxes: np.ndarray
    scores: np.ndarray
    numbers: np.ndarray


@dataclass(frozen=True)
class Reader:
    """A function that reads the outputs of one network.

    Parameters
    ----------
    title : title of the network, for messages.
    form : form of the outputs.
    names : names of its outputs, in the order of the form.
    numbers : numbers of its classes that count.
    """

    title: str
    form: OutputForm
    names: tuple[str, ...]
    numbers: tuple[int, ...]

    def __call__(
        self, outputs: Mapping[str, np.ndarray], size_px: tuple[int, int], least_score: float
    ) -> Candidates:
        """Return the boxes with a score of at least `least_score`.

        Parameters
        ----------
        outputs : {name of the output: array}.
        size_px : width and height of the input.
        least_score : smallest score of a box.

        Raises
        ------
        ConfigError : an output does not have the shape of the form, or a class has no score.
        """
        arrays = [np.asarray(outputs[name], float) for name in self.names]
        match self.form.form:
            case "apart":
                boxes = self._table(arrays[0], 0, 4)
                found = self._best(boxes, self._table(arrays[1], 1, None))
            case "joined":
                rows = self._table(arrays[0], 0, None)
                self._at_least(rows, 0, 4 + self.form.objectness)
                found = self._best(rows[:, :4], rows[:, 4:])
            case "rows":
                rows = self._table(arrays[0], 0, 6)
                found = Candidates(rows[:, :4], rows[:, 4], rows[:, 5].astype(int))
            case "labelled":
                boxes = self._table(arrays[0], 0, 4)
                numbers = self._line(arrays[2], 2, len(boxes)).astype(int)
                found = Candidates(boxes, self._line(arrays[1], 1, len(boxes)), numbers)
        return self._kept(found, size_px, least_score)

    def _kept(self, found: Candidates, size_px: tuple[int, int], least_score: float) -> Candidates:
        kept = np.isin(found.numbers, self.numbers) & np.isfinite(found.boxes).all(1)
        kept &= found.scores >= least_score  # false for NaN
        boxes = corners(found.boxes[kept], self.form.box)
        if self.form.unit == "share":
            boxes = boxes * np.tile(size_px, 2)
        return Candidates(boxes, found.scores[kept], found.numbers[kept])

    def _best(self, boxes: np.ndarray, scores: np.ndarray) -> Candidates:
        """Return each box with the class of the highest score, among the classes that count."""
        if len(scores) != len(boxes):
            raise ConfigError(
                f"{self.title} has {len(boxes)} boxes and scores of {len(scores)}; expected the"
                " same number; see output.form and output.boxes_last in its description"
            )
        first = int(self.form.objectness)
        self._at_least(scores, -1, first + 1 + max(self.numbers))
        if self.form.activation == "sigmoid":
            scores = expit(scores)
        elif self.form.activation == "softmax":
            scores = softmax(scores, axis=1)
        numbers = np.array(self.numbers)
        of_classes = scores[:, numbers + first]
        if self.form.objectness:
            of_classes = of_classes * scores[:, :1]
        best = of_classes.argmax(1)
        return Candidates(boxes, of_classes[np.arange(len(best)), best], numbers[best])

    def _at_least(self, table: np.ndarray, place: int, columns: int) -> None:
        if table.shape[1] < columns:
            raise ConfigError(
                f"the output {self.names[place]!r} of {self.title} has {table.shape[1]} columns"
                f" of scores; expected at least {columns}, for the classes"
                f" {', '.join(map(str, self.numbers))}; see classes and output in its description"
            )

    def _table(self, array: np.ndarray, place: int, columns: int | None) -> np.ndarray:
        """Return an output as a table (boxes, columns); `columns` None: any number."""
        table = array[0] if array.ndim == 3 and array.shape[0] == 1 else array
        if table.ndim == 2 and self.form.boxes_last:
            table = table.T
        if table.ndim != 2 or columns not in (None, table.shape[1]):
            expected = ["n", str(columns or "columns")]
            if self.form.boxes_last:
                expected.reverse()
            raise ConfigError(
                f"the output {self.names[place]!r} of {self.title} has the shape"
                f" {shape_text(array.shape)}; expected 1 x {' x '.join(expected)}; see"
                " output.form and output.boxes_last in its description"
            )
        return table

    def _line(self, array: np.ndarray, place: int, count: int) -> np.ndarray:
        """Return an output that has one value for each box, (boxes,)."""
        if array.size != count:
            raise ConfigError(
                f"the output {self.names[place]!r} of {self.title} has the shape"
                f" {shape_text(array.shape)}; expected one value for each of {count} boxes"
            )
        return array.reshape(count)
