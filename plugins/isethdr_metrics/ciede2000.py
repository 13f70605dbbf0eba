"""CIEDE2000: mean colour difference between a picture and its truth, both against one white."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Ciede2000:
    """Mean CIEDE2000 of valid pixels up to the white, for the frame and for each object."""

    white_cd_m2: float = 0.0  # luminance of the white (D65) for both pictures; 0 takes the truth's 99th percentile without lamps

    def narrow(self, demand):
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(self, picture, truth, labels=None):
        """Return the difference per region and, so that it can be read, the white that was used.

        Pixels whose truth is brighter than the white are left out: CIELAB is defined for surfaces, not for lamps.
        """
        from isethdr_core import ledger
        from isethdr_core.physics.colour import D65_XYZ, de2000, lab
        from isethdr_core.scores import Score
        from isethdr_core.view import white_cd_m2

        from .regions import frame_and_objects, luminances, mean_interval

        _, true, valid = luminances(picture, truth)
        white = self.white_cd_m2 or white_cd_m2(truth)
        difference = de2000(lab(truth["xyz"].values, white * D65_XYZ), lab(picture["xyz"].values, white * D65_XYZ))
        use = valid & (true <= white)
        share = 1 - use.mean()
        if share > 0:
            ledger.left_out("pixels above the white or not valid", "CIELAB has no meaning there", share, "share of the frame")
        scores = [Score("ciede2000", value, "dE00", name, low, high)
                  for name, region in frame_and_objects(true.shape, labels)
                  for value, low, high in [mean_interval(difference, region & use)]]
        return [*scores, Score("ciede2000_white", float(white), "cd m-2")]
