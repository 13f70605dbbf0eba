"""Command line: the commands, their tables, and their progress.

| module           | what                                                                         |
|------------------|------------------------------------------------------------------------------|
| `commands`       | the commands `isethdr run`, `plan`, `plugins`, `doctor` and those of plugins |
| `deferred_libraries` | large libraries that the command line loads when they are first used |
| `progress`       | which stage is running, for how long, and how long it still takes            |
| `summary_tables` | the table of a run, the plan of one, and the list of plugins                 |
| `terminal`       | the one console that prints for people, without markup                       |
"""

from .commands import main as main
