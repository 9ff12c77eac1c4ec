"""Whether this computer has pseudo-terminals: a bare chroot without /dev/pts has none."""

import os
import pty

import pytest


def _has_terminals() -> bool:
    try:
        ends = pty.openpty()
    except OSError:
        return False
    for end in ends:
        os.close(end)
    return True


needs_terminal = pytest.mark.skipif(not _has_terminals(), reason="no pseudo-terminals: /dev/pts is not there")
