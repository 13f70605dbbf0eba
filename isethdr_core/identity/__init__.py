"""Identity: what a result is called, from the code, libraries and data that made it.

| module          | what                                                                       |
|-----------------|----------------------------------------------------------------------------|
| `code_facts`    | what one Python file says, apart from layout, messages and import paths    |
| `code_cache`    | facts and digests, kept in the process and between processes               |
| `code_digest`   | which code makes a component's results, whatever its modules are called    |
| `earlier_names` | what runs and radiance were called while whole packages named the code     |

`runs.provenance` puts these together for the components of a run.
"""
