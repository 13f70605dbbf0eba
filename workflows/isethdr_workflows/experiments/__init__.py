"""Experiments: the results of docs/explanation/findings.md, computed again step by step.

`make experiments` runs all steps, `isethdr experiments list|run` some of them.

| module    | what                                                                                |
|-----------|-------------------------------------------------------------------------------------|
| `steps`   | the steps: commands, files that they make, expected minutes                         |
| `records` | which steps are finished, and how long they took                                    |
| `driver`  | run steps: skip finished ones, stop at the time limit, pass Ctrl-C on               |
| `child`   | a command of a step, which ends with the driver even if the driver is killed        |
| `results` | the tables of all steps on one page                                                 |
| `command` | the command line                                                                    |
"""
