"""Import of the published ISETHDR deposit, a tree of folders, into the home folder.

| file | holds |
|---|---|
| command | `isethdr import-iset` |
| tree | which files of a tree belong to which scene, and which to no scene |
| importing | scenes as stores; stored scenes are skipped, and damaged ones are reported |
"""
