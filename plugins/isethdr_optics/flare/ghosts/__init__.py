"""Ghosts: light reflected twice between surfaces of a lens prescription.

| module           | content                                                         |
|------------------|-----------------------------------------------------------------|
| `draw`           | light sources of the scene, and their ghost rays on grids       |
| `ghost_flare`    | the flare `ghosts`                                              |
| `sensor_limited` | the ghosts that are bright enough for a sensor in this scene    |
| `trace`          | ghost pairs ranked by paraxial matrices, and their real rays    |
"""
