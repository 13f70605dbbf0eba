"""Vehicles as families of ranges.

| module       | content                                                  |
|--------------|----------------------------------------------------------|
| bicycles     | city, racing, mountain, folding and cargo bicycles       |
| cars         | passenger cars and vans                                  |
| heavy        | trucks and buses                                         |
| motorcycles  | motorcycles and scooters                                 |
| two_wheelers | shapes of both from `data/two_wheelers.yaml`             |
"""
