"""Storage: zarr stores that are either whole or not there, and that name their damage.

| module         | what                                                                            |
|----------------|---------------------------------------------------------------------------------|
| `arrays`       | datasets as files of zarr v3, written without an event loop                     |
| `atomic_write` | what is being written, and what killed writers left behind                      |
| `encoding`     | chunks, shards, codecs and rounding, decided in this one place                  |
| `join`         | join the stores of one scene along light group and wavelength without reading   |
| `manifest`     | size and checksum of every file, so that damage is named and never read as data |
| `reader`       | what differs from the manifest is an error, never a fill value                  |
| `store`        | zarr v3 stores that are either whole or not there                               |
"""
