"""Pictures of the kinds of base road.

| module        | content                                            |
|---------------|----------------------------------------------------|
| `command`     | `isethdr roads list` and `isethdr roads sheet`     |
| `from_above`  | each kind drawn from above                         |
| `driver_view` | each kind rendered from the camera's car, by day   |
"""
