"""Paths: the integrator, its passes, and the tables that it reads on the device.

| module           | content                                                     |
|------------------|-------------------------------------------------------------|
| `by_need/`       | adaptive sampling: plan of paths, their sums and variances  |
| `camera_rays`    | the first rays of the paths of a tile                       |
| `device_memory`  | NumPy arrays that compiled code reads in whole vectors      |
| `film_bands`     | Mitsuba's own integrator, for machines without LLVM or CUDA |
| `fog_tables`     | extinction of each band, and phase function                 |
| `hits`           | what a ray meets, looked up in tables of all triangles      |
| `integrator`     | one path, all bands, all light groups                       |
| `passes`         | passes of the integrator, summed in float64 outside Mitsuba |
| `spectra`        | spectra of surfaces and of light, band by band              |
| `surface_tables` | material at the hit point of a ray, and its reflectance     |
| `tracing/`       | the compiled loop that follows paths from surface to surface |
| `texture_noise`  | noise that mixes the two reflectances of a surface          |
| `work_items`     | the tiles and paths of one launch                           |
"""
