"""Mesh: primitives, implicit surfaces, exact cuts, and pieces that are joined.

| module       | content                                                     |
|--------------|-------------------------------------------------------------|
| `cutting`    | split a sheet exactly along the zero line of a scalar field |
| `implicit`   | smooth unions of tapered capsules, meshed by marching cubes |
| `piece`      | parts that can be moved, renamed and joined                 |
| `primitives` | quad grids, balls, boxes, lathed profiles and tubes         |
"""
