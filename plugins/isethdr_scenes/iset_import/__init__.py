"""Import of the published ISETHDR deposit, a tree of folders, into the home folder.

| file | holds |
|---|---|
| command | `isethdr import-iset` |
| tree | which files of a tree belong to which scene, and which to none |
| importing | scenes as stores: what is stored already is skipped, what is wrong is named |
"""
