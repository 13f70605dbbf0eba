"""Sweeps: the results of the jobs of a sweep, and one table of their scores.

| module        | what                                                                    |
|---------------|-------------------------------------------------------------------------|
| `record`      | the folder of a sweep, in which each job writes its result              |
| `table`       | one row for each job and camera, with scores and intervals; CSV         |
| `score_order` | which end of a score is the better one, and whether two scores differ   |
"""
