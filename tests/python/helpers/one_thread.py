"""Imported before numpy: decompositions of small matrices take longer on several threads than on one."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
