"""`python -m stepdiag.head_text` prints the table of keys in docs/head.md."""

from stepdiag.head_keys import HeadFile
from stepdiag.key_text import key_table

if __name__ == "__main__":
    print(key_table(HeadFile))
