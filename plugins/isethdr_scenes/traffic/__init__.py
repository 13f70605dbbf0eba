"""Traffic: motion of the vehicles and people of a street over time.

| module          | content                                                             |
|-----------------|---------------------------------------------------------------------|
| `tracks`        | lanes as tables: places, headings, speeds, and which lanes cross    |
| `following`     | the intelligent driver model                                        |
| `drivers`       | drivers: routes, speeds, and the distance to the next obstacle      |
| `junctions`     | right of way at junctions                                           |
| `signal_plan`   | states of traffic lights over time                                  |
| `obstacles`     | things and people in the way of a lane                              |
| `pedestrians`   | people who walk                                                     |
| `simulation`    | steps of a tenth of a second, and the state at any time             |
| `later_layout`  | the layout and the camera's car at a later time                     |
| `sumo/`         | traffic simulated by SUMO, in place of the modules above            |
"""
