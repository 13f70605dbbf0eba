"""Ghosts: light reflected twice between surfaces of a lens prescription.

| module           | what                                                                 |
|------------------|----------------------------------------------------------------------|
| `draw`           | light sources found in the scene                                     |
| `ghost_flare`    | the flare `ghosts`: light reflected twice between surfaces of a lens |
| `sensor_limited` | the other pairs of surfaces are left out                             |
| `trace`          | ghost pairs ranked by paraxial matrices                              |
"""
