"""Experiments: everything that the questions' pages claim, made again step by step.

`make experiments` runs all steps, `isethdr experiments list|run` some of them.

| module    | what                                                                                |
|-----------|-------------------------------------------------------------------------------------|
| `steps`   | the steps: commands, what they make, expected minutes                               |
| `records` | which steps are finished, and how long they took                                    |
| `driver`  | run steps: skip what is there, stop at the time limit, pass Ctrl-C on               |
| `child`   | a command of a step, which ends with the driver, also if that is killed             |
| `results` | the tables of all steps on one page                                                 |
| `command` | the command line                                                                    |
"""
