"""Trucks and buses of any size: a cab or a body on the lofted shell, loads, chassis, lamps.

| module    | content                                                        |
|-----------|----------------------------------------------------------------|
| `shapes`  | `Truck` and `Bus`: their parameters, and sizes without a mesh  |
| `cab`     | a cab over the engine                                          |
| `loads`   | box, curtain sides, tank, tipping trough, flatbed              |
| `chassis` | frame, wheels, guards, rear lamps                              |
| `trucks`  | rigid trucks, and tractors or trucks with a trailer            |
| `buses`   | city buses, coaches, articulated buses, double deckers         |
"""
