"""A measuring program in LinuxCNC whose readings do not come: it stops, says which, and asks again."""

from pathlib import Path

from stepdiag.linuxcnc.session import LinuxcncSession
from stepdiag.program.measuring_program import measuring_program
from stepdiag.program.options import Options
from stepdiag.scenario.description import parse_scenario

SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp"]
steps = 1
[head]
layout = "ideal"
[plan_by_time]
feed_mm_per_min = 60000.0
settle_s = 0.0
"""


def test_a_program_without_an_answer_stops_and_cycle_start_asks_again(tmp_path: Path) -> None:
    path = tmp_path / "run.ngc"
    path.write_text(measuring_program(parse_scenario(SCENARIO).known, Options(timeout=0.1, align=False)).text)
    stops: list[str] = []

    def at_stop(session: LinuxcncSession, line: int, messages: list[str]) -> None:
        stops.append(" ".join(messages))
        if sum("no reading" in stop for stop in stops) == 3:
            session.set_pin("motion.digital-in-00", True)  # from now on every reading is answered at once

    with LinuxcncSession() as session:
        session.run_program(path, at_stop, timeout=60.0)
        assert "set-up 1 of 1" in stops[0]
        assert len(stops) == 4  # three times in vain, the fourth time not
        assert all("no reading of visit 1.0" in stop and "point 0.0" in stop for stop in stops[1:])
        # The last reading asked for, and its request taken back.
        assert session.pins(["motion.analog-out-00", "motion.analog-out-01", "motion.digital-out-00"]) == [
            1.0,
            3.0,
            False,
        ]
