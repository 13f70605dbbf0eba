"""Plugins: what a plugin offers, how it is found, and which values its fields may hold.

| module           | content                                                                     |
|------------------|-----------------------------------------------------------------------------|
| `abilities`      | compare a component's class with the Protocols of its kind                  |
| `accuracy_knobs` | fields that trade accuracy for time, as a component declares them           |
| `builtin`        | the components of the core: lightings                                       |
| `component`      | what a plugin offers under `kind/name`; one component at work               |
| `config_paths`   | folders with presets, as plugins name them                                  |
| `descriptions`   | what `isethdr plugins` prints of each component, kept on disk               |
| `field_docs`     | meaning, unit, default, range and origin of each field of a component       |
| `hookspecs`      | the six hooks of a plugin                                                   |
| `presets`        | the YAML files of plugins, as the command line lists them                   |
| `protocols`      | what each kind is called with, and the abilities that it may offer          |
| `ranges`         | the values that a field may hold, declared where the field is defined       |
| `registry`       | collect plugins with pluggy and look components up by `kind/name`           |
| `yaml_text`      | YAML of installed packages, read quickly                                    |
"""
