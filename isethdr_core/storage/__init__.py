"""Storage: zarr stores that are either whole or not there, and that name their damage.

| module             | what                                                                     |
|--------------------|--------------------------------------------------------------------------|
| `arrays`           | datasets as files of zarr v3, written without an event loop              |
| `atomic_write`     | temporary names, renamed when whole; stale ones are removed              |
| `bounded_cache`    | files of results, the least recently used removed first                  |
| `encoding`         | chunks, shards, codecs and rounding of stored arrays                     |
| `exact_encoding`   | results as bytes and back, without any loss                              |
| `home_folder`      | the folder of all that is stored                                         |
| `join`             | stores of one scene joined along light group and wavelength, unread      |
| `manifest`         | size and checksum of every file: damage is named and never read as data  |
| `picture_rounding` | pictures in float32, rounded by their own noise                          |
| `reader`           | reads compared with the manifest: a difference is an error               |
| `store`            | zarr v3 stores that are either whole or not there                        |
"""
