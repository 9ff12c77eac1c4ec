"""Adapter between a device on a serial port and `stepdiag acquire` (docs/acquisition.md, "Lines").

    stepdiag acquire scenario.toml --source "program:python3 serial_adapter.py /dev/ttyUSB0" -o run.csv

The device prints a line for each sample: distance (mm), spot x and spot y (um), `-` where it is dark.
Change CHANNELS, the speed and sample() for yours. A card for data acquisition has its own library:
print the header, then a line for every sample, and nothing else.
"""

import json
import sys
import termios
import tty

CHANNELS = {"distance_mm": 1.0, "spot_x_mm": 1e-3, "spot_y_mm": 1e-3}  # name: the device's unit, in mm


def sample(line: str) -> dict[str, float | None]:
    """The values of a line of the device by channel, None where it was dark."""
    words = zip(CHANNELS.items(), line.split(), strict=True)
    return {name: None if word == "-" else float(word) * unit for (name, unit), word in words}


with open(sys.argv[1], "rb", buffering=0) as port:
    tty.setraw(port)
    settings = termios.tcgetattr(port)
    settings[4] = settings[5] = termios.B115200
    termios.tcsetattr(port, termios.TCSANOW, settings)
    print(json.dumps({"stepdiag_lines": 1, "instrument": sys.argv[1], "channels": list(CHANNELS)}), flush=True)
    port.readline()  # perhaps the end of a line
    while line := port.readline():
        try:
            content = sample(line.decode("ascii"))
        except ValueError:  # disturbed on its way
            content = dict.fromkeys(CHANNELS) | {"why": f"the device sent {line[:40]!a}"}
        print(json.dumps(content), flush=True)
