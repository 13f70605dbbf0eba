from dataclasses import dataclass
from isethdr_core import Component, Score, hookimpl


@dataclass(frozen=True)
class Darkest:
    """Luminance of the darkest valid pixel."""

    def __call__(self, picture, truth, labels):
        y = picture["xyz"].sel(xyz_channel="Y").where(picture["valid"])
        return [Score("darkest", float(y.min()), "cd m-2")]


@hookimpl
def isethdr_components():
    return [Component("metric", "darkest", Darkest)]
