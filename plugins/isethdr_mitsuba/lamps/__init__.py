"""Lamps: from candela to radiance, and the sampling of lamps.

| module             | content                                            |
|--------------------|----------------------------------------------------|
| `airlight_sampling` | choice of a lamp, and of the place on a ray where fog scatters its light |
| `beam_lamp`        | the beam-limited area light as a Mitsuba emitter   |
| `device_grids`     | grids of luminance on the device                   |
| `intensity_grid`   | luminance of a lamp from its table of candela      |
| `lamp_tables`      | lamps as lookup tables for shadow rays             |
| `near_lamps`       | important lamps, each sampled by its own shadow ray |
| `placed_lamps`     | lamps in the world: luminous intensity to radiance |
| `sky_discs`        | sun and moon as lamps far away                     |
| `sky_dome`         | a sky with a gradient, on the device               |
| `sky_openings`     | openings of tunnels and the like as targets of shadow rays to the sky |
| `spatial_sampling` | probability of sampling a lamp, by place           |
| `spot_shares`      | probability of sampling a spot                     |
| `spots`            | lamps as spots, for the variant without a compiler |
| `visible_lamps`    | lamps seen directly, with their exact footprint    |
"""
