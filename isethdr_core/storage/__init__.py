"""Storage: zarr stores that are either complete or absent, with checks against damage.

| module              | content                                                            |
|---------------------|--------------------------------------------------------------------|
| `arrays`            | datasets as files of zarr v3, written without an event loop        |
| `atomic_write`      | temporary names, renamed when complete; stale ones are removed     |
| `bounded_cache`     | files of results, the least recently used removed first            |
| `encoding`          | chunks, shards, codecs and rounding of stored arrays               |
| `exact_encoding`    | results as bytes and back, without any loss                        |
| `home_folder`       | the folder of all stores                                           |
| `join`              | stores of one scene joined lazily along light group and wavelength |
| `manifest`          | size and checksum of every file, so that damage is an error        |
| `object_home`       | a home in an object store, with a scratch folder on each machine   |
| `picture_rounding`  | pictures in float32, rounded by their own noise                    |
| `radiance_rounding` | radiance in float32, each tile rounded by its own noise            |
| `reader`            | reads compared with the manifest: a difference is an error         |
| `store`             | zarr v3 stores that are either complete or absent                  |
"""
