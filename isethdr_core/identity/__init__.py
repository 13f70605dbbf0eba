"""Identity: the names of results, derived from the code, libraries and data that made them.

| module          | content                                                                    |
|-----------------|----------------------------------------------------------------------------|
| `code_facts`    | facts about one Python file, without layout, messages and import paths     |
| `code_cache`    | facts and digests, kept in the process and between processes               |
| `code_digest`   | the code that makes a component's results, independent of module paths     |
| `earlier_names` | names of runs and radiance from the time when whole packages named code    |

`runs.provenance` combines these for the components of a run.
"""
