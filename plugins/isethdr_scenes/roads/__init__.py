"""Roads: networks of roads as OpenDRIVE describes them, and poses of things on them.

| module           | content                                                             |
|------------------|---------------------------------------------------------------------|
| `profile`        | piecewise cubic polynomials along a road                            |
| `reference_line` | lines, arcs and spirals in plan; points beside them                 |
| `cubic_record`   | curves of cubic polynomials, as pieces of a reference line          |
| `lateral_shape`  | heights across a road                                               |
| `road`           | one road: heights, sections of lanes, marks, objects, structures    |
| `lane_path`      | the middle of a lane as traffic drives along it                     |
| `ground_height`  | the height of roads and land at plan points                         |
| `free_areas`     | strips along the roads where roadside things may stand              |
| `layouts`        | builders of networks from the ranges of a kind                      |
| `kinds`          | the kinds of base road: a table of ranges, and what stands with it  |
| `checks`         | gaps, steps, widths and curvatures of a network                     |
| `stations`       | places along a road, close where it bends                           |
| `markings`       | what is painted on a road                                           |
| `surface`        | meshes of roads, markings and land that meet without gaps           |
| `ground`         | the parts of these meshes: arrangement, terrain, structures         |
| `pictures`       | `isethdr roads`: each kind from above and from the car              |
| `opendrive`      | road files of the user                                              |
| `network`        | roads, junctions and land together: the interface for placing       |
"""
