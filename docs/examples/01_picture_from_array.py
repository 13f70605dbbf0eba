"""A camera looks at a picture of your own: an array of linear RGB in cd/m2.

New here: a scene from an array, and the chain by hand, stage by stage.
"""

from pathlib import Path

import numpy as np

import isethdr_core as hdr

image = np.load(Path(__file__).parent / "gradient.npy")  # (y, x, 3), from 1 to 1000 cd/m2
np.save("gradient.npy", image)  # your array, as a file that a run can name

field = {"path": "gradient.npy", "unit": "cd/m2", "horizontal_field_deg": 8.0}
radiance = hdr.build("scene", "file", **field)()  # spectra that have these colours
mixed = hdr.build("lighting", "ideal")(radiance)  # the sum of all light groups
light = hdr.build("lens", "ideal")(mixed)  # irradiance on the sensor plane
sensor = hdr.build("sensor", "bayer")
key = hdr.generator(seed=0, device="A", scene="file")  # source of all random numbers
captures = sensor(light, key)  # DN
picture = hdr.build("isp", "linear")(captures)  # cd/m2

brightest = picture["xyz"].sel(xyz_channel="Y").max().item()
print(f"{brightest:.4g} cd/m2 in the brightest pixel")
