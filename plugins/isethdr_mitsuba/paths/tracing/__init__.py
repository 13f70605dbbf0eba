"""Tracing: the compiled loop that follows the paths of a launch.

| module          | content                                                              |
|-----------------|----------------------------------------------------------------------|
| `airlight`      | light that fog scatters into a ray                                   |
| `lanes`         | what each lane of compiled code knows: path, numbers, paths to follow |
| `launch_tables` | the scene, the spectra and the work items on the device              |
| `light_met`     | light of the sky or of a lamp that a ray meets by itself             |
| `segments`      | how a path begins, what it meets, where it ends and how it goes on   |
| `shadow_rays`   | light of lamps, and of the sky through openings, on a surface        |
| `trace`         | the loop                                                             |
"""
