"""What all tests share: tables are as wide as in a pipe, whatever the terminal that the tests are started from."""

import os

os.environ.pop("COLUMNS", None)
