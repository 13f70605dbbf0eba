"""Tracing: the compiled loop that follows the paths of a launch.

| module          | content                                                              |
|-----------------|----------------------------------------------------------------------|
| `airlight`      | light that fog scatters into a ray                                   |
| `lanes`         | state of a lane: its path, random numbers and paths still to follow  |
| `launch_tables` | the scene, the spectra and the work items on the device              |
| `light_met`     | light of the sky or of a lamp that the ray of a path hits            |
| `segments`      | start of a path, hit of its ray, its end or continuation             |
| `shadow_rays`   | light of lamps, and of the sky through openings, on a surface        |
| `trace`         | the loop                                                             |
"""
