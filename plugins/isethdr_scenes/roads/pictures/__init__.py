"""Pictures of the kinds of base road, and of road files.

| module        | content                                            |
|---------------|----------------------------------------------------|
| `command`     | `isethdr roads`: list, sheet, write, check         |
| `from_above`  | each kind drawn from above                         |
| `file_plan`   | a road file: its plan, and what it holds           |
| `driver_view` | each kind rendered from the camera's car, by day   |
"""
