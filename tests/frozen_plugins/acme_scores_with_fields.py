from dataclasses import dataclass
from isethdr_core import Component, Score, hookimpl


@dataclass(frozen=True)
class Darkest:
    """Luminance below which a share of the valid pixels lies."""

    share: float = 0.001  # of the valid pixels

    def __call__(self, picture, truth, labels):
        from isethdr_core.truth import check_picture

        check_picture(picture)
        if not picture["valid"].any():
            return []  # all saturated: nothing to say
        seen = picture.sel(xyz_channel="Y").where(picture["valid"])
        value, noise = float(seen["xyz"].quantile(self.share)), float(seen["variance"].max()) ** 0.5
        return [
            Score("darkest", value, "cd m-2", low=value - 1.96 * noise, high=value + 1.96 * noise)
        ]


@hookimpl
def isethdr_components():
    return [Component("metric", "darkest", Darkest)]
