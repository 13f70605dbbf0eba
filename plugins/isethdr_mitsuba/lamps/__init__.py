"""Lamps: from candela to radiance, and which lamp a path looks for.

| module             | what                                                                      |
|--------------------|---------------------------------------------------------------------------|
| `beam_lamp`        | the beam-limited area light as a Mitsuba emitter                          |
| `lamp_tables`      | radiance by shape hit, and the choice of the point that a shadow ray aims |
| `placed_lamps`     | from luminous intensity to radiance                                       |
| `spatial_sampling` | how likely a lamp is to be looked at from a surface                       |
| `spot_shares`      | as much as it lights what the camera sees                                 |
| `spots`            | the same candela from points in front of them                             |
| `visible_lamps`    | lamps seen directly, with their exact footprint                           |
"""
