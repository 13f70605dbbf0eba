"""The functions that `calls` uses on an object home. The import loads obstore and zarr."""

from .index_upkeep import tidy_index as tidy_index
from .publication import is_copy as is_copy
from .publication import publish as publish
from .publication import withdraw as withdraw
from .reader import check_published as check_published
from .reader import published_problems as published_problems
from .reader import published_store as published_store
from .reader import release_copy as release_copy
from .scratch import check_writable as check_writable
from .scratch import follow as follow
from .scratch import publish_pending as publish_pending
from .shared_labels import merge_labels as merge_labels
from .space import bucket_use as bucket_use
from .space import interrupted_uploads as interrupted_uploads
from .space import remove_uploads as remove_uploads
