"""Where things stand in the repository."""

from pathlib import Path

ROOT = Path(__file__).parents[3]
DATA = ROOT / "tests" / "data"
KNOWN = ROOT / "python" / "stepdiag" / "selftest" / "known"  # what `stepdiag selftest` compares with
RUNS = KNOWN / "runs"  # with known truth, made by another program
DOCS = ROOT / "docs"
EXAMPLES = ROOT / "examples"
SHIPPED_HEADS = ROOT / "python" / "stepdiag" / "head" / "shipped"
