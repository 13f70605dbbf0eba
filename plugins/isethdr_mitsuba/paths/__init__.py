"""Paths: the integrator, its passes, and the tables that it reads on the device.

| module           | content                                                     |
|------------------|-------------------------------------------------------------|
| `camera_rays`    | how the paths of a tile begin                               |
| `device_memory`  | NumPy arrays that compiled code reads in whole vectors      |
| `film_bands`     | Mitsuba's own integrator, for machines without a compiler   |
| `hits`           | what a ray meets, looked up in tables of all triangles      |
| `integrator`     | one path, all bands, all light groups                       |
| `need_driven`    | rounds of paths where cameras see the noise, in two buffers |
| `need_plan`      | the fewest paths that bring every tile below its limit      |
| `passes`         | passes of the integrator, summed in float64 outside Mitsuba |
| `spectra`        | colours of surfaces and of light, band by band              |
| `surface_tables` | which material a ray met, its reflectance table             |
| `tallies`        | sums tile by tile, and how much single paths vary           |
| `texture_noise`  | where a surface has its second reflectance                  |
| `work_items`     | which paths of which tiles one launch follows               |
"""
