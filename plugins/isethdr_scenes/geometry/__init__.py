"""Procedural geometry: meshes computed from parameters; nothing is loaded.

| module          | content                                                               |
|-----------------|-----------------------------------------------------------------------|
| `heavy/`        | trucks and buses of any size                                          |
| `mesh/`         | primitives, implicit surfaces, exact cuts, and pieces that are joined |
| `road_users/`   | people, cyclists and deer                                             |
| `surroundings/` | ground, road, tunnel, plants, houses and roadside furniture           |
| `two_wheelers/` | bicycles, motorcycles and scooters                                    |
| `vehicles/`     | cars, one truck and one bus, on lofted shells                         |
"""
