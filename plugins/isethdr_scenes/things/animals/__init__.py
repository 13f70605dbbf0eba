"""Four-legged animals by proportions.

| module      | content                                                          |
|-------------|------------------------------------------------------------------|
| `families`  | animals of the data file, drawn and built                        |
| `coat`      | patches of a coat: belly, socks, blotches, spots                 |
| `head`      | skull, eyes, ears, antlers, horns and tusks                      |
| `quadruped` | trunk, neck, legs and tail                                       |
"""
