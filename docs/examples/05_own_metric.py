"""A metric of your own: the share of pixels that are darker than a luminance.

New here: a component of your own, and the reference picture. To use the metric in runs by its name,
put the class into a package: `isethdr new-plugin metric darker_than`.
"""

from dataclasses import dataclass
from typing import Annotated

import isethdr_core as hdr
from isethdr_core import Range, Score
from isethdr_core.truth import check_picture, truth


@dataclass(frozen=True)
class DarkerThan:
    """Share of the valid pixels whose luminance is below a limit."""

    limit_cd_m2: Annotated[float, Range(0, 1e9)] = 10.0  # the luminance

    def __call__(self, picture, reference, labels):
        """Return one score, 0 to 1; none where no pixel is valid."""
        check_picture(picture)
        valid = picture["valid"].values
        if not valid.any():
            return []
        y = picture["xyz"].sel(xyz_channel="Y").values[valid]
        return [Score("darker_than", float((y < self.limit_cd_m2).mean()), "")]


chart = hdr.build("scene", "macbeth", width=48, height=27, horizontal_field_deg=8.0)
mixed = hdr.build("lighting", "ideal")(chart())
captures = hdr.build("sensor", "bayer")(
    hdr.build("lens", "ideal")(mixed), hdr.generator(seed=0, device="A", scene="macbeth")
)
picture = hdr.build("isp", "linear")(captures)
[score] = DarkerThan(limit_cd_m2=20.0)(picture, truth(mixed, picture), None)
print(f"{score.value:.1%} of the pixels are darker than 20 cd/m2")
