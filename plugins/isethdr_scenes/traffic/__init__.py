"""Traffic: a layout of a street moves on by seconds.

| module          | content                                                             |
|-----------------|---------------------------------------------------------------------|
| `tracks`        | lanes as tables: places, headings, speeds, and which cross          |
| `following`     | the intelligent driver model                                        |
| `drivers`       | who drives: routes, speeds, and what is ahead of each               |
| `junctions`     | who may enter a junction                                            |
| `signal_plan`   | what traffic lights show at each time                               |
| `obstacles`     | what stands or walks in the way of a lane                           |
| `pedestrians`   | who walks                                                           |
| `simulation`    | steps of a tenth of a second, and the state at any time             |
| `later_layout`  | the layout and the camera's car at a time                           |
| `sumo/`         | traffic that SUMO drives, in place of all that                      |
"""
