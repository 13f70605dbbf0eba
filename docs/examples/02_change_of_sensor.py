"""Another sensor looks at the same light.

New here: a sensor with several captures, its fields, and the isp that merges captures.
"""

import isethdr_core as hdr

sun = 2e4  # cd/m2 of a white patch
size = {"width": 48, "height": 27, "horizontal_field_deg": 8.0}
chart = hdr.build("scene", "macbeth", luminance_cd_m2=sun, **size)
light = hdr.build("lens", "ideal")(hdr.build("lighting", "ideal")(chart()))
sensor = hdr.build("sensor", "split_pixel", exposure_s=0.008)
captures = sensor(light, hdr.generator(seed=0, device="A", scene="macbeth"))
picture = hdr.build("isp", "merge")(captures)

for name in captures["capture"].values:
    saturated = float(captures["saturated"].sel(capture=name).mean())
    print(name, f"{saturated:.1%} saturated")
