"""Night and day from one scene: the light groups are weighted, and nothing is rendered again.

New here: light groups and their weights.
"""

import isethdr_core as hdr

size = {"width": 48, "height": 27, "horizontal_field_deg": 8.0}
scene = hdr.build("scene", "point_lights", background_cd_m2=1000.0, **size)()
lens = hdr.build("lens", "ideal")
sensor = hdr.build("sensor", "bayer")
key = hdr.generator(seed=0, device="A", scene="point_lights")
day, captures = (
    sensor(lens(hdr.build("lighting", "weights", weights=weights)(scene)), key)
    for weights in ({"sky": 1.0, "headlights": 1.0}, {"sky": 1e-3, "headlights": 1.0})
)

for name, shot in (("day", day), ("night", captures)):
    print(name, f"{float(shot['raw'].mean()):.4g} DN")
