"""Ground: meshes of roads, land and structures that meet without gaps.

| module        | content                                                                 |
|---------------|-------------------------------------------------------------------------|
| `arrangement` | the plan of all roads as faces that share their vertices                |
| `terrain`     | rings of triangles around the roads                                     |
| `structures`  | decks of bridges, tunnels with their portals, rails                     |
"""
