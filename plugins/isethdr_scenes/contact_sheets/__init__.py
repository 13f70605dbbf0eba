"""Contact sheets: small pictures of things, rendered by day or by night.

| module  | content                                                        |
|---------|----------------------------------------------------------------|
| command | `isethdr things`: `list`, `sheet`, `check`, `materials`        |
| choice  | selection of the things that a sheet shows                     |
| view    | the scene of one thing: ground, sky, camera, lamps that are on |
| sheet   | renders the tiles and writes the picture and its key           |
"""
