"""Vehicles: cars, trucks and buses, on lofted shells.

| module       | what                                                                             |
|--------------|----------------------------------------------------------------------------------|
| `body`       | the shell as one sheet, out of which glass, lamps, gaps and wheel houses are cut |
| `bus`        | a city bus on the lofted shell                                                   |
| `car`        | a body from one of the shapes of `car_shapes`, its windows, gaps                 |
| `car_cabin`  | mirrors, handles, rails and wipers; seats and dashboard                          |
| `car_front`  | grille, headlamps, intake and plate                                              |
| `car_rear`   | tail lamps, diffuser, exhausts and plate                                         |
| `car_shapes` | four tables of the same parameters, all lengths in metres                        |
| `headlamp`   | round lamps in the front of a vehicle                                            |
| `panels`     | regions cut out of the flat faces of trucks and buses, and their mirrors         |
| `shell`      | profiles and a plan outline lofted into one smooth sheet                         |
| `truck`      | cab on the lofted shell, cargo box of plain parts                                |
| `wheels`     | wheels and licence plates                                                        |
"""
