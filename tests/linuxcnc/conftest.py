"""What the tests in LinuxCNC share: a table of errors, and the machine that has them."""

from pathlib import Path

import pytest
from linuxcnc_machine import CHAIN, EXPANSION_LINES, MODULE, TOOL, VOLUME, make_errors

from stepdiag import Machine


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if not MODULE.exists():
        for item in items:
            if "nc_rs274" not in item.nodeid:
                item.add_marker(pytest.mark.skip(reason="./run linuxcnc installs LinuxCNC and its module stepdiagkins"))


@pytest.fixture(scope="session")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("table") / "calibration.csv"
    make_errors().write(path, chain=CHAIN, volume=VOLUME, tool=TOOL)
    return path


@pytest.fixture(scope="session")
def warm_table(table: Path) -> Path:
    """The same table, referred to 20 °C by a known expansion."""
    path = table.with_name("warm.csv")
    path.write_text(EXPANSION_LINES + table.read_text())
    return path


@pytest.fixture(scope="session")
def truth() -> Machine:
    """The virtual machine whose errors the table holds: an independent statement of what a compensation must undo."""
    return Machine(CHAIN, make_errors(), TOOL)
