"""`python -m stepdiag.head_text` prints the table of keys in docs/head.md."""

from stepdiag.config.head_keys import HeadFile
from stepdiag.config.key_reference import key_table

if __name__ == "__main__":
    print(key_table(HeadFile))
