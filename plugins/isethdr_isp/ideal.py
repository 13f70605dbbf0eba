"""Ideal: nothing but the inverse of an ideal sensor; noise and saturation are not thought of."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class IdealIsp:
    """Plain inverse of an ideal sensor: no demosaic where every pixel samples every channel, least-squares colour matrix."""

    def __call__(self, captures):
        """Return the picture; exact when the channels span the colour matching functions and there is no filter array.

        Without a filter array every capture is one channel at every pixel. With one, the first capture is
        demosaiced. The colour matrix takes no account of noise.
        """
        import numpy as np

        from isethdr_core.errors import UnitError

        from .combine import Merged
        from .develop import develop, finish
        from .development import Development
        from .readout import check_captures, chosen, falloff, readouts
        from .spectra import light

        check_captures(captures)
        filters = captures["filter"].values
        alone = np.all(filters == filters[0, 0])
        if not alone:
            captures = chosen(captures, "")
        elif captures.sizes["channel"] > 1:
            raise UnitError(f"of {captures.sizes['channel']} channels all but one are sampled nowhere in the filter array; a cropped "
                            "pattern? use at least one whole period")
        reads = readouts(captures, light("daylight", captures.wavelength.values))
        planes = np.stack([r.charge_e - r.dark_e for r in reads])
        variances = np.stack([r.variance_e2() for r in reads])
        valid = ~np.any([r.saturated for r in reads], axis=0)
        if not alone:
            one = Merged(planes[0], variances[0], valid, np.zeros(valid.shape, np.uint8))
            return develop(one, reads[:1], captures, Development(design_snr=np.inf))
        response = np.stack([r.response[filters[0, 0]] for r in reads])
        level = falloff(captures)
        return finish(planes / level, variances / level**2, valid, response, captures, "daylight", np.inf)
