"""Configuration: component fields as Hydra groups, single runs, sweeps, and trusted folders.

| module        | what                                                                      |
|---------------|---------------------------------------------------------------------------|
| `composition` | dataclass fields become typed config groups, presets join the search path |
| `component_source` | the config group entry of each component, made when it is chosen |
| `hydra_app`   | single runs, sweeps (`-m`) and launchers; a failure is one line           |
| `job`         | the run of a composed config, and its summary for people                  |
| `main_config` | what `config.yaml` chooses and sets, read without composing it            |
| `sweeps`      | sweeps (`-m`): mistakes are found before the first job                    |
| `trust`       | which folders a config file may come from, checked before Hydra opens any |
| `conf/`       | the main config and the presets of lightings                              |
"""
