"""What the sensors of a twin's machine show, written to a file as the program of real sensors does."""

from datetime import UTC, datetime
from pathlib import Path

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.temperature_file import ONE_SENSOR, OWN_SENSORS
from stepdiag.io.whole_files import check_output, reason
from stepdiag.scenario.description import Scenario, air_of, simulation_options
from stepdiag.units import unit_of

AIR = {
    "air_temperature": "air_temperature_c",
    "air_pressure": "air_pressure_hpa",
    "air_humidity": "air_humidity_percent",
}


class TwinTemperatures:
    """The file; it is begun, or continued if a twin of such a scenario wrote it.

    Temperatures are those of the simulated run's row that the twin is at."""

    def __init__(self, scenario: Scenario, path: Path) -> None:
        """Raises InvalidArgument for a scenario without temperatures, and for a file that another program wrote."""
        options = simulation_options(scenario)
        self._path, self._scales = path, options.scales
        self._seconds = options.seconds_per_reading or 0.0
        self._air = {AIR[name]: value / unit_of(AIR[name]).native for name, value in air_of(scenario).items()}
        columns = ["time", *self._scale_values(0), *self._air]
        if len(columns) == 1:
            raise InvalidArgument(f"{scenario.path}: expected [temperature] or the air of a constant index, got none")
        header = ",".join(columns) + "\n"
        check_output(path)
        try:
            with path.open("a+", encoding="utf-8") as file:
                file.seek(0)
                first = file.readline()
                if not first:
                    file.write(header)
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        if first and first != header:
            raise InvalidArgument(
                f"{path}: exists, and is not continued: expected {header.strip()}, got {first[:80]!r}"
            )

    def append(self, row: int) -> None:
        """Append what sensors show at this row of the simulated run."""
        values = (self._scale_values(row) | self._air).values()
        fields = [datetime.now(UTC).isoformat(timespec="milliseconds"), *(repr(float(value)) for value in values)]
        with self._path.open("a", encoding="utf-8") as file:
            file.write(",".join(fields) + "\n")

    def _scale_values(self, row: int) -> dict[str, float]:
        scales = self._scales
        if scales is None:
            return {}
        now = scales.start + scales.rate * (row * self._seconds)
        return {ONE_SENSOR: now[0]} if scales.one_sensor else dict(zip(OWN_SENSORS, now, strict=True))
