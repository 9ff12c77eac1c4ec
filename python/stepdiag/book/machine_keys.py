"""Keys of machine.toml: which machine it is."""

from typing import Annotated

from pydantic import Field

from stepdiag.config.key_types import POSITIVE, Format, Positive, Section, format_key, key
from stepdiag.config.report_keys import LONGEST

Text = Annotated[str, Field(min_length=1, max_length=LONGEST)]
_TEXT = f"a text of 1 to {LONGEST} characters"


class AboutMachine(Section):
    """A machine of the book, as a person knows it."""

    format: Format = format_key()
    title: Text | None = key(_TEXT, "Maker and type of the machine.", None)
    serial_number: Text | None = key(_TEXT, "Serial number.", None)
    customer: Text | None = key(_TEXT, "Whose machine it is.", None)
    place: Text | None = key(_TEXT, "Where it stands.", None)
    notes: Text | None = key(_TEXT, "What else to know.", None)
    limit_um: Positive | None = key(POSITIVE, "Limit of the largest error in the volume, µm.", None)
    interval_days: Positive | None = key(POSITIVE, "Longest time between two calibrations, days.", None)


def toml_of(about: AboutMachine) -> str:
    """The file: keys without a value as comments."""
    lines = []
    for name, field in AboutMachine.model_fields.items():
        value = getattr(about, name)
        lines += ["", f"# {field.description}"]
        lines += [f"# {name} =" if value is None else f"{name} = {_toml(value)}"]
    return "\n".join(lines[1:]) + "\n"


def _toml(value: str | float) -> str:
    """A TOML value; a basic string escapes quotes, backslashes and control characters as JSON does."""
    if not isinstance(value, str):
        return f"{value:g}" if isinstance(value, int) or value != int(value) else f"{value:.1f}"
    import json

    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
