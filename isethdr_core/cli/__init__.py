"""Command line: the commands, their tables, and their progress.

| module           | content                                                                      |
|------------------|------------------------------------------------------------------------------|
| `commands`       | the commands `isethdr run`, `plan`, `plugins`, `doctor` and those of plugins |
| `completion`     | tab completion: what may follow on the command line                          |
| `vocabulary`     | the words of tab completion, from commands, components and presets           |
| `completion_scripts/` | completion scripts that bash, zsh and fish read when they start         |
| `deferred_libraries` | large libraries that the command line loads when they are first used |
| `home_option`    | `--home PATH` of every command                                               |
| `new_plugin`     | packages for the components of plugin authors                                |
| `plugin_template/` | copier template of the package that `new_plugin` writes                    |
| `progress`       | which stage is running, for how long, and how long it still takes            |
| `plan_summary`   | what a run would compute, what is stored, and what is left out               |
| `plugin_list`    | components and presets, and the fields of each                               |
| `run_help`       | what `isethdr run --help` prints                                             |
| `sweep_progress` | one line while a sweep runs: how many of its runs are done, and time left    |
| `sweep_summary`  | the table of a sweep after its jobs                                          |
| `summary_tables` | the tables and warnings of a run                                             |
| `terminal`       | the one console that prints for people, without markup                       |
"""

from .commands import main as main
