"""World: a scene description as Mitsuba objects, and the camera's grid of tiles.

| module                | content                                                              |
|-----------------------|----------------------------------------------------------------------|
| `angle_sensor`        | a camera on a grid of angles for Mitsuba's own integrators           |
| `coat_energy`         | light lost between facets in scalar variants                         |
| `compensated_surface` | rough surfaces without loss between facets, in Python                |
| `geometry`            | parts, models and poses as a Mitsuba scene                           |
| `materials`           | materials as Mitsuba surfaces                                        |
| `own_surfaces`        | the two surfaces in Python; importing this module imports Mitsuba    |
| `retro_surface`       | retro-reflection as a Mitsuba surface, in Python                     |
| `triangle_chords`     | triangles subdivided until their sides are straight in angles        |
| `view`                | the camera as a grid of tiles in tangents or angles, with overscan   |
"""
