"""Vehicles as families of ranges.

| module | content                |
|--------|------------------------|
| cars   | passenger cars and vans |
"""
