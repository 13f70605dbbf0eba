"""Vehicles: cars, trucks and buses, on lofted shells.

| module       | content                                                                  |
|--------------|--------------------------------------------------------------------------|
| `body`       | the shell, with glass, lamps, gaps and wheel houses cut out of it        |
| `bus`        | a city bus on the lofted shell                                           |
| `car`        | passenger cars                                                           |
| `car_cabin`  | mirrors, handles, wipers, seats and dashboard                            |
| `car_front`  | grille, headlamps, intake and plate                                      |
| `car_rear`   | tail lamps, diffuser, exhausts and plate                                 |
| `car_shapes` | shapes of passenger cars as tables                                       |
| `grille`     | grilles of passenger cars                                                |
| `headlamp`   | round lamps in the front of a vehicle                                    |
| `panels`     | regions cut out of the flat faces of trucks and buses, and their mirrors |
| `shell`      | the outer skin of a vehicle, lofted into one sheet                       |
| `truck`      | a rigid truck: its cargo box, frame and wheels                           |
| `truck_cab`  | the cab of the rigid truck                                               |
| `wheels`     | wheels and licence plates                                                |
"""
