"""Vehicles as families of ranges.

| module  | content                                   |
|---------|-------------------------------------------|
| bicycle | the bicycle of `geometry.road_users`      |
| cars    | passenger cars and vans                   |
"""
