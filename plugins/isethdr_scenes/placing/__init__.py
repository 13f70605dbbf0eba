"""Placing of things on a road and next to it. They are drawn from a seed before meshes are made.

| module            | content                                                               |
|-------------------|-----------------------------------------------------------------------|
| `plan`            | the steps in their order, densities, and the resulting layout         |
| `site`            | a road being filled: where things may stand, and what is occupied     |
| `boxes`           | oriented boxes of things, and whether two overlap                     |
| `ground`          | poses from the heights under a thing                                  |
| `shortage`        | a density that cannot be placed                                       |
| `vehicles`        | traffic in the lanes, with brake lights, indicators and queues        |
| `parked`          | parked vehicles                                                       |
| `living`          | people, riders and animals                                            |
| `plants`          | trees, bushes and rocks                                               |
| `buildings`       | rows of buildings; rows of panels                                     |
| `barriers`        | guard rails, barriers, marker posts, boards of road works             |
| `street_lights`   | street lamps and traffic lights                                       |
| `road_signs`      | signs                                                                 |
| `pavement_things` | bus stops, benches, bins, bollards                                    |
| `daytime`         | lamps that are on by day                                              |
| `camera`          | a camera on a vehicle                                                 |
| `rules`           | checks of a layout                                                    |
"""
