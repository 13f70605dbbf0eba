"""Paths: the integrator, its passes, and the tables that it reads on the device.

| module           | what                                                                        |
|------------------|-----------------------------------------------------------------------------|
| `camera_rays`    | camera rays spread evenly over it, wavelengths over the places of its bands |
| `film_bands`     | mitsuba's own path integrator, group by group, four bands at a time         |
| `hits`           | what a ray meets, looked up in tables of all triangles                      |
| `integrator`     | one path, all bands, all light groups: the integrator                       |
| `passes`         | passes of the integrator, summed in float64 outside Mitsuba                 |
| `spectra`        | colours of surfaces and of light, band by band                              |
| `surface_tables` | which material a ray met, its reflectance table                             |
"""
