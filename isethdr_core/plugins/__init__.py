"""Plugins: what a plugin offers, how it is found, and which values its fields may hold.

| module      | what                                                                           |
|-------------|--------------------------------------------------------------------------------|
| `builtin`   | the members of the kind lighting                                               |
| `component` | what a plugin offers under `kind/name`                                         |
| `hookspecs` | all that a plugin may provide                                                  |
| `ranges`    | which values a component's field may hold, declared where the field is defined |
| `registry`  | collect plugins with pluggy and look components up by `kind/name`              |
"""
