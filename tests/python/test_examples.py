"""The examples run as they stand, and importing the package stays quick."""

import subprocess
import sys
from pathlib import Path

import stepdiag as sd

EXAMPLES = Path(__file__).parents[2] / "examples"


def output_of(*arguments: str | Path) -> str:
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def test_quickstart_shows_that_enhanced_is_better() -> None:
    lines = output_of(EXAMPLES / "quickstart.py").splitlines()
    conventional, enhanced = lines
    assert conventional.startswith("conventional: positioning known to 100.0")
    assert enhanced.startswith("enhanced: positioning known to 0.0")
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    assert "\n".join(f"    {line}" for line in lines) in readme
    code = (EXAMPLES / "quickstart.py").read_text(encoding="utf-8")
    assert all(line in code for line in readme.split("```python\n")[1].split("```")[0].splitlines())


def test_own_measurement_goes_from_files_to_a_table(tmp_path: Path) -> None:
    scenario = EXAMPLES / "scenario.toml"
    sd.simulate_scenario(sd.read_scenario(scenario)).write(tmp_path / "run.csv")
    assert output_of(EXAMPLES / "own_measurement.py", scenario, tmp_path / "run.csv").startswith("EXX at x = 400 mm")


def test_import_brings_nothing_heavy() -> None:
    heavy = "('matplotlib', 'xarray', 'pandas', 'pydantic')"
    code = f"import sys, stepdiag.cli; print([m for m in {heavy} if m in sys.modules])"
    assert output_of("-c", code).strip() == "[]"


def test_evaluating_a_scenario_imports_neither_plots_nor_tables() -> None:
    code = (
        "import sys, stepdiag as sd; sd.read_scenario(sys.argv[1]); "
        "print([m for m in ('matplotlib', 'xarray', 'pandas') if m in sys.modules])"
    )
    assert output_of("-c", code, EXAMPLES / "scenario.toml").strip() == "[]"


def test_every_exported_name_is_there() -> None:
    for name in sd.__all__:
        assert getattr(sd, name) is not None
    assert set(sd.__all__) <= set(dir(sd))
