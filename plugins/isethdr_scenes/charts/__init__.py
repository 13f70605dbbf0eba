"""Test charts: scene radiance in closed form, without a renderer.

| module           | content                                                           |
|------------------|-------------------------------------------------------------------|
| `uniform`        | one radiance everywhere (also the kind's `ideal` member)          |
| `macbeth`        | 24 patches of a colour checker under a daylight                   |
| `slanted_edge`   | a straight edge between two luminances, exact in every tile       |
| `point_lights`   | five discs, each ten times dimmer than the last, on a dark ground |
| `moving_target`  | a bar and a lamp that move sideways at constant speed             |
| `luminance_ramp` | equal luminance ratios from column to column over eight decades   |
| `chart`          | fields that all charts share; grid, illuminant, dataset           |
| `daylight`       | the CIE's daylight illuminants                                     |
| `coverage`       | exact areas of discs and half planes in tiles                     |
"""
