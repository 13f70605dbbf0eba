"""Lamps through a lens with haze: light is scattered into the dark parts of the picture.

New here: a lens with a point spread function, and a flare.
"""

import isethdr_core as hdr

scene = hdr.build("scene", "point_lights", width=48, height=27, horizontal_field_deg=8.0)
mixed = hdr.build("lighting", "ideal")(scene())
lens = hdr.build("lens", "diffraction_limited")
haze = hdr.build("flare", "haze", scattered=0.02)
light = lens(mixed, flares=[haze])
sensor = hdr.build("sensor", "bayer")
captures = sensor(light, hdr.generator(seed=0, device="A", scene="point_lights"))

clean = lens(mixed)
ratio = float(light.min() / clean.min())
print(f"{ratio:.4g} times the light in the darkest place")
