"""Layouts: builders of networks from the ranges of a kind of road.

| module          | content                                                             |
|-----------------|---------------------------------------------------------------------|
| `draw`          | values drawn from ranges, each with a generator of its own          |
| `cross_section` | lanes with drawn widths, and the lines between them                 |
| `vertical`      | grades joined by parabolas                                          |
| `corridor`      | one road: curves, heights, tunnel, works, crosswalk                 |
| `junction`      | roads that connect the lanes of several road ends                   |
| `crossings`     | crossing, T-junction, roundabout, car park                          |
| `levels`        | bridge over a road, exit ramp, railway crossing                     |
"""
