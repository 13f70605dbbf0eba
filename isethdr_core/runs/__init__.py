"""Runs: one stored run, the stored radiance it reads, its noise, and what made it.

| module                | what                                                                   |
|-----------------------|------------------------------------------------------------------------|
| `claims`              | of several processes that want the same scene                          |
| `names`               | checked where users type them, and again where they are written        |
| `noise_realisations`  | the same shot in several noise realisations                            |
| `parent_watch`        | workers of a sweep end when the process that started them is gone      |
| `processor`           | which processor computed a result, and what the libraries chose for it |
| `provenance`          | versions and source digests of the packages that took part             |
| `radiance_cache`      | use what is stored, render only what is missing                        |
| `run`                 | named by the hash of what made it, computed at most once               |
| `run_warnings`        | exposures that make the scores of a camera say little                  |
| `sample_accumulation` | what several renderings of the same light know together                |
| `seeds`               | random numbers keyed by what they are for, so that order               |
"""
