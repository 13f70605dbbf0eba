"""Procedural geometry: meshes computed from parameters; nothing is loaded.

| module          | content                                                               |
|-----------------|-----------------------------------------------------------------------|
| `mesh/`         | primitives, implicit surfaces, exact cuts, and pieces that are joined |
| `road_users/`   | people, cyclists and deer                                             |
| `surroundings/` | ground, road, tunnel, plants, houses and roadside furniture           |
| `two_wheelers/` | bicycles, motorcycles and scooters                                    |
| `vehicles/`     | cars, trucks and buses, on lofted shells                              |
"""
