"""Object homes: a home in an object store, such as s3://bucket/prefix, with a local scratch folder.

| module          | content                                                                 |
|-----------------|-------------------------------------------------------------------------|
| `address`       | addresses of object homes, and the scratch folder of each               |
| `bucket`        | requests to the object store; each failure is one clear error           |
| `calls`         | calls from the rest of the storage; they do nothing for a plain folder  |
| `operations`    | functions behind `calls`; importing this module loads obstore           |
| `index_segment` | one segment of the index: contents of small objects, compressed         |
| `index_upkeep`  | completes the index and merges its segments, for `catalog gc`           |
| `publication`   | stores uploaded, and made visible by one conditional write              |
| `scratch`       | the scratch folder follows the catalog of the bucket                    |
| `reader`        | groups of a published store, read from the bucket and checked           |
| `shared_index`  | reads contents from the index; adds to it by compare-and-swap           |
| `space`         | space of a home in its bucket, and the remains of interrupted uploads   |
| `shared_labels` | labels of runs, merged by compare-and-swap                              |

Objects below the prefix of a home:

    catalog/<part>/<name>.json           published store: where its files are, and its manifest
    <part>/<name>-<upload>.zarr/<file>   files of one upload; never changed
    labels/<name>.json                   labels of a run; changed by compare-and-swap
    index/1/<random>.zst                 contents of many of the two above; compare-and-swap

The name of an upload has a random part, so that two writers never mix their files. The object in
`catalog/` is written last, and only if no object has that name. A store without such an object does
not exist for readers. The catalog of a home is the listing of `catalog/`. The index only saves
requests: its content of an object is used only if the listing names the same version of the object.

Each machine has a scratch folder for each object home. It is an ordinary home folder, where runs
are computed. If only the bucket holds a store, the scratch folder has a stub of it: its root
attributes and its manifest. All other modules work on the scratch folder.
"""
