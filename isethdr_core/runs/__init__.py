"""Runs: one stored run, the stored radiance it reads, its noise, and what made it.

| module                | content                                                              |
|-----------------------|----------------------------------------------------------------------|
| `claims`              | one process renders a scene, the others wait                         |
| `labels`              | name, tags and sweeps of a stored run, in a file beside its store    |
| `names`               | names that become folders of a store, checked                        |
| `noise_realisations`  | scores over several noise realisations of one shot                   |
| `parent_watch`        | workers of a sweep end with the process that started them            |
| `processor`           | which processor computed a result, and which library kernels it used |
| `provenance`          | code of the components, library versions, input files                |
| `radiance_cache`      | stored scene radiance; missing radiance is rendered                  |
| `rendering`           | radiance and labels of a scene rendered whole, without cameras       |
| `result_names`        | names of intermediate results, from components and inputs            |
| `reuse`               | intermediate results of earlier runs, with their stated errors       |
| `run`                 | one stored run, named by the hash of what made it                    |
| `run_warnings`        | exposures at which the scores of a run are of little use             |
| `sample_accumulation` | several stored renderings of the same light as one                   |
| `seeds`               | random numbers keyed by shot, device and purpose                     |
"""
