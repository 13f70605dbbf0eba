"""People: bodies by build and age, clothes, poses.

| module     | content                                                       |
|------------|---------------------------------------------------------------|
| `body`     | proportions of a body, and the joints of its poses            |
| `carried`  | rucksacks, bags and sticks                                    |
| `clothes`  | garments around joints: trousers, skirts, jackets, coats      |
| `families` | people of the data file, drawn and built                      |
| `gait`     | walking people: their speed, and their pose after a distance  |
| `head`     | skull, face, hair and hats                                    |
| `mounted`  | the joints of a rider who reaches grips and pedals            |
| `riders`   | riders of the data file, for a given bicycle or motorcycle    |
"""
