"""Results: stored runs opened by name, shown in notebooks, and drawn.

| module   | what                                                        |
|----------|-------------------------------------------------------------|
| `stored` | find the store of a run by its first digits or its name     |
| `html`   | what a notebook shows of a run                              |
| `plot`   | pictures the right way up, with units                       |
"""
