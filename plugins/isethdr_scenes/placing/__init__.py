"""Placing: what stands on a road and beside it, drawn from a seed before any mesh is made.

| module            | content                                                               |
|-------------------|-----------------------------------------------------------------------|
| `plan`            | the steps in their order, densities, and the layout that comes out    |
| `site`            | a road being filled: who may stand where, and what is taken           |
| `boxes`           | oriented boxes of things, and whether two overlap                     |
| `ground`          | poses from the heights under a thing                                  |
| `shortage`        | a density that cannot be placed                                       |
| `vehicles`        | traffic in the lanes, with brake lights, indicators and queues        |
| `parked`          | parked vehicles                                                       |
| `living`          | people, riders and animals                                            |
| `plants`          | trees, bushes and rocks                                               |
| `buildings`       | rows of buildings; panels end to end                                  |
| `barriers`        | guard rails, barriers, marker posts, boards of road works             |
| `street_lights`   | street lamps and traffic lights                                       |
| `road_signs`      | signs                                                                 |
| `pavement_things` | bus stops, benches, bins, bollards                                    |
| `daytime`         | lamps by day                                                          |
| `camera`          | a camera on a vehicle                                                 |
| `rules`           | checks of a layout                                                    |
"""
