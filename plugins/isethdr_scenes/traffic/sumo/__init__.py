"""Traffic by SUMO (extra `traffic`): a road as SUMO's net, and the places of vehicles over time.

| module          | content                                                               |
|-----------------|-----------------------------------------------------------------------|
| `program`       | SUMO's programs, their version, and their messages                    |
| `net`           | a network of roads as SUMO's net: edges, lanes, and connections       |
| `lane_below`    | the lane of the road on which a vehicle is                            |
| `demand`        | the vehicles that a traffic density requires, and their routes        |
| `lights`        | traffic lights: a plan as SUMO's program, and the states it reports   |
| `trace`         | SUMO's report of each vehicle: place, speed, signals                  |
| `overlaps`      | vehicles of a trace that touch others, and the area that they sweep   |
| `traffic`       | traffic at a chosen second, and its layouts at later times            |
| `own_files`     | a user's route files and configurations of SUMO                       |
| `configuration` | a copy of a user's configuration that writes no file                  |
| `choice`        | the placer or SUMO, and the things that the placer adds to SUMO's     |
"""
