"""Common parts of the ghost tests: a lens whose ghosts can be computed independently, a lamp, and
the flux of an image.
"""

import numpy as np

from isethdr_core.data import quantities

SINGLET = {
    "name": "bare",
    "f_number": 4.0,
    "surfaces": [
        {"stop": True, "thickness_mm": 0.5, "semi_diameter_mm": 12.0},
        {"radius_mm": 150.0, "thickness_mm": 6.0, "glass": "1.9", "semi_diameter_mm": 14.0},
        {"radius_mm": -220.0, "semi_diameter_mm": 14.0},
    ],
}


def lamp(n, pitch, row, column, bands=(550.0,)):
    x = quantities.centres(n, n * pitch)
    values = np.zeros((len(bands), n, n))
    values[:, row, column] = 1e3
    return quantities.plane(values, list(bands), x, x, quantities.RADIANCE)


def flux(light):
    """Return the flux on the sensor, W/nm per band."""
    return (
        light.values.sum(axis=(1, 2))
        * quantities.tile_pitch(light, "x")
        * quantities.tile_pitch(light, "y")
    )
