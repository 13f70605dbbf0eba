"""Identity: the names of results, derived from the code, libraries and data that made them.

| module             | content                                                                     |
|--------------------|-----------------------------------------------------------------------------|
| `name_bindings`    | which imports and definitions bind a name in a file                         |
| `message_texts`    | strings of a file that people read, without effect on a result            |
| `normal_form`      | a file's syntax tree as text, without layout, messages and import paths     |
| `code_facts`       | facts about one file: its normal form, and what it refers to                |
| `code_cache`       | facts and digests, kept in the process and between processes                |
| `package_sources`  | where the modules and data files of packages lie                            |
| `core_modules`     | modules of the core that components compute with, or that change no result  |
| `import_targets`   | where an imported name is defined                                           |
| `module_contents`  | one module, with the targets of its imports and its data files              |
| `library_versions` | the installed version of a library, by its import name                      |
| `code_digest`      | the code that makes a component's results, independent of module paths      |
| `earlier_names`    | names of runs and radiance from the time when whole packages named code     |

The rows stand in the order of use: each module needs those above it. `runs.provenance` combines
digests, versions and input files for the components of a run.
"""
