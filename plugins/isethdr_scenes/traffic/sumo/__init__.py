"""Traffic by SUMO (extra `traffic`): a road as SUMO's net, its traffic, and where who is when.

| module       | content                                                               |
|--------------|-----------------------------------------------------------------------|
| `program`    | SUMO's programs, their version, and what they say                     |
| `net`        | a network of roads as SUMO's net: edges, lanes, and the ways on       |
| `lane_below` | the lane of the road on which a vehicle is                            |
| `demand`     | vehicles for a density, and their routes                              |
| `lights`     | traffic lights: a plan as SUMO's program, and the states it reports   |
| `trace`      | what SUMO reports of each vehicle: place, speed, signals              |
| `overlaps`   | vehicles of a trace that touch others, and what all of them sweep     |
| `traffic`    | traffic at a chosen second, and its layouts at later times            |
| `own_files`  | a user's route files and configurations of SUMO                       |
| `choice`     | the placer or SUMO, and what the placer adds to SUMO's traffic       |
"""
