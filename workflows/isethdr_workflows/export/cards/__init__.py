"""Records that describe an exported folder for other catalogs.

| module       | content                                                       |
|--------------|---------------------------------------------------------------|
| `properties` | properties of each picture: run, camera, sensor, scores       |
| `stac`       | a STAC collection with one item for each picture              |
| `croissant`  | Croissant metadata, with a table of the pictures              |
"""
