"""Road users: people, cyclists and deer.

| module    | content                                                              |
|-----------|----------------------------------------------------------------------|
| `cyclist` | a bicycle and its rider                                              |
| `deer`    | implicit body with legs, neck, head, ears, tail and optional antlers |
| `head`    | skull, face, hair or helmet                                          |
| `person`  | implicit garments around posed joints                                |
| `poses`   | joints of a walker, and arms and legs that reach                     |
"""
