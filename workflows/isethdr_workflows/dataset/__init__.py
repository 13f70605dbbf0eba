"""Datasets: many scenes drawn from a recipe, rendered, verified, described; `isethdr dataset`.

| module             | what                                                                        |
|--------------------|-----------------------------------------------------------------------------|
| `recipe`           | families of scenes and the distributions of their settings, read from YAML  |
| `draw`             | settings of scene number k, which depend on the seed but not on the count   |
| `record`           | the folder of a dataset: its definition, and one file for each scene        |
| `generate`         | render the scenes that are missing                                          |
| `workers`          | share chunks of scenes between processes or the nodes of a SLURM cluster    |
| `runtime_estimate` | time and disk of a dataset, from the scenes that are made                   |
| `verify`           | check every scene against its store and its recipe                          |
| `splits`           | training, validation and test parts that keep a road together               |
| `summary`          | counts, luminances, time and bytes of the scenes; duplicates and outliers   |
| `page`             | the page of a dataset: contact sheets by day and night, counts, histograms  |
| `pairs/`           | raw captures with and without flare, ghosts, noise and blur                 |
| `study/`           | cameras over a dataset: scores and objects, with intervals over roads       |
| `card`             | the description of a dataset in Markdown                                    |
| `packs`            | asset packs behind the scenes, with their licences                          |
| `actions`          | functions behind the commands, which compute, write and print               |
| `command`          | the command line                                                            |
"""
