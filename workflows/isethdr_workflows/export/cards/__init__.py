"""Records that describe an exported folder to catalogs of others.

| module       | content                                                       |
|--------------|---------------------------------------------------------------|
| `properties` | what is stated of each picture: run, camera, sensor, scores   |
| `stac`       | a STAC collection with one item for each picture              |
| `croissant`  | Croissant metadata, with a table of the pictures              |
"""
