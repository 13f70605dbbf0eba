"""Roads: networks of roads as OpenDRIVE describes them, and where things stand on them.

| module           | content                                                             |
|------------------|---------------------------------------------------------------------|
| `profile`        | piecewise cubic polynomials along a road                            |
| `reference_line` | lines, arcs and spirals in plan; points beside them                 |
| `road`           | one road: heights, sections of lanes, marks, objects, structures    |
| `lane_path`      | the middle of a lane as traffic drives along it                     |
| `ground_height`  | the height of roads and land at plan points                         |
| `free_areas`     | strips along the roads where roadside things may stand              |
| `network`        | roads, junctions and land together: the interface for whatever places |
"""
