"""Lamps: from candela to radiance, and which lamp a path looks for.

| module             | content                                            |
|--------------------|----------------------------------------------------|
| `beam_lamp`        | the beam-limited area light as a Mitsuba emitter   |
| `device_grids`     | grids of luminance on the device                   |
| `intensity_grid`   | the luminance that makes a table of candela        |
| `lamp_tables`      | lamps as lookup tables for shadow rays             |
| `near_lamps`       | lamps that each have a shadow ray of their own     |
| `placed_lamps`     | lamps in the world: luminous intensity to radiance |
| `sky_discs`        | sun and moon as lamps far away                     |
| `sky_dome`         | the sky with a gradient on the device              |
| `spatial_sampling` | how likely a lamp is looked for from a surface     |
| `spot_shares`      | how often each spot is looked for                  |
| `spots`            | lamps as spots, for the variant without a compiler |
| `visible_lamps`    | lamps seen directly, with their exact footprint    |
"""
