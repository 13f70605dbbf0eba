"""Procedural geometry: meshes computed from parameters; nothing is loaded.

| file | holds |
|---|---|
| piece | `Piece` (a part that can be moved), `Assembly`, matrices, normals |
| primitives | grid, ball, box, lathe, tube |
| cutting | exact cut of a sheet along a scalar field, outlines |
| implicit | smooth unions of capsules, marching cubes |
| shell, body | lofted vehicle skin, and what is cut out of it |
| wheels | wheel, licence plate |
| car, car_front, car_rear, car_cabin | sedan, hatchback, SUV and van |
| car_shapes, headlamp | their measures as data; round lamps in the front of a vehicle |
| truck, bus, panels | heavy vehicles |
| poses, person, head, cyclist | people |
| deer | deer |
| plants | broadleaf tree, spruce, bush, grass |
| ground, road, roadside, house, tube | the ground line, the road and what stands beside it, the tunnel |
"""
