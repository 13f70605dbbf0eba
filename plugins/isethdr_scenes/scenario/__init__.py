"""OpenSCENARIO 1.x files (.xosc): road file, entities and positions at the start of a scenario.

| module          | content                                                           |
|-----------------|-------------------------------------------------------------------|
| `scenario_file` | the file: its road file, its entities, its initial positions      |
| `catalogs`      | entities that are described in catalog files                      |
| `parameters`    | values of parameters, and arithmetic with them                    |
| `positions`     | positions on lanes, on roads and in the world as places in plan   |
| `start`         | road, camera and entities of a street at the start                |
| `entities`      | things of a street for the entities of a scenario                 |
"""
