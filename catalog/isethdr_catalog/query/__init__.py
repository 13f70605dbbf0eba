"""Queries: `find` by conditions, `sql` for everything else, `show` one store.

All three functions read one home or several (`storage.home_folder.existing_homes`).

| file            | content                                                                |
|-----------------|------------------------------------------------------------------------|
| `found_records` | `find`: records by conditions                                          |
| `conditions`    | the SQL of these conditions                                            |
| `sql_queries`   | `sql`: queries of the user, which see the records only                 |
| `one_store`     | `show`: the attributes of one store                                    |
| `connection`    | a database with the records of homes, which can reach nothing else     |
"""

from .conditions import typed_conditions
from .connection import SANDBOX, Homes
from .found_records import find, path_of
from .one_store import show, shown
from .sql_queries import sql

__all__ = ["SANDBOX", "Homes", "find", "path_of", "show", "shown", "sql", "typed_conditions"]
