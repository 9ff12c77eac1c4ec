"""Whether this computer has pseudo-terminals: a bare chroot without /dev/pts has none, nor has Windows."""

import os

import pytest


def _has_terminals() -> bool:
    try:
        ends = os.openpty()
    except (AttributeError, OSError):
        return False
    for end in ends:
        os.close(end)
    return True


needs_terminal = pytest.mark.skipif(not _has_terminals(), reason="no pseudo-terminals")
