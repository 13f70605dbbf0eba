"""Configuration: component fields as Hydra groups, single runs, sweeps, and trusted folders.

| module             | content                                                              |
|--------------------|----------------------------------------------------------------------|
| `composition`      | dataclass fields as typed config groups; presets in the search path  |
| `chunk_launcher`   | launchers `slurm_chunks` and `local_chunks`: an array of chunks of jobs |
| `component_source` | the config group entry of each component, made on first use          |
| `hydra_app`        | single runs, sweeps (`-m`) and launchers; one line for each failure  |
| `hydra_shortcuts`  | leaves out parts of Hydra's work whose results are not used          |
| `job`              | the run of a composed config, and its summary                        |
| `kept_choices`     | configs composed from choices alone, kept for the next call          |
| `main_config`      | choices and settings of `config.yaml`, read without composing it     |
| `packed`           | a config as bytes, from which copies are made quickly                |
| `preset_source`    | presets of installed packages, each file parsed once a process       |
| `sweeps`           | sweeps (`-m`): mistakes are found before the first job               |
| `trust`            | folders from which config files are accepted, checked in advance     |
| `typed_text`       | quotes around texts that Hydra would read as numbers, such as dates  |
| `conf/`            | the main config and the presets of lightings                         |
"""
