"""Data: what crosses the borders between stages, with its units and checks.

| module                | what                                                                  |
|-----------------------|-----------------------------------------------------------------------|
| `camera_geometry`     | where a sensor looks, as the attributes of irradiance                 |
| `categories`          | COCO's where COCO has the class, ours from 1000                       |
| `quantities`          | dims, units, attributes, and the checks on them                       |
| `reference_picture`   | the picture that a camera without noise, blur and flare would make    |
| `saturation`          | which pixels of a picture are saturated in every capture              |
| `scene_description`   | geometry, materials, lamps, camera and sky, in metres                 |
| `scores`              | one row per metric and object, and how sure a metric is of them       |
| `temporal_modulation` | components of mixed radiance and irradiance, each with one modulation |
"""
