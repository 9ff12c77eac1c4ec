"""The person whom an acquisition asks: at the terminal, or whoever watches it."""

import os
import select
import sys
import time
from typing import Final

import click

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.control import Control
from stepdiag.acquisition.live_state import LiveState
from stepdiag.cli.options import in_flags
from stepdiag.cli.terminal import plain
from stepdiag.platform import of_standard_input

BETWEEN_LINES: Final = 0.2  # s between two states on a terminal
BAR: Final = 20  # columns
_KEYS: Final[dict[str, Control]] = {"r": "repeat_point", "k": "keep"}


class Watched:
    """Nobody at the terminal: questions are answered by whoever watches. What is told goes to standard output."""

    def __init__(self) -> None:
        self._stored = 0

    def tell(self, text: str) -> None:
        click.echo(plain(in_flags(text)))

    def confirm(self, text: str) -> None:
        raise InvalidArgument(f"{text}: nobody watches")

    def repeats(self, text: str) -> bool:
        return False

    def ask(self, text: str, answers: list[Control]) -> None:
        self.tell(text)

    def answered(self) -> Control | None:
        return None

    def withdraw(self) -> None:
        pass

    def show(self, state: LiveState) -> None:
        """A line a reading."""
        if state.stored > self._stored:
            self._stored = state.stored
            click.echo(plain(state.last))


class Terminal(Watched):
    """The person at the terminal. What happens now stands in its last line."""

    def __init__(self) -> None:
        super().__init__()
        self._is_terminal = sys.stdout.isatty()
        self._width = 0  # of the last line
        self._shown = 0.0
        self._is_open = False  # a question stands in the last line
        self._typed = b""
        self._answers: list[Control] = []

    def tell(self, text: str) -> None:
        self._clear()
        super().tell(text)

    def confirm(self, text: str) -> None:
        self.ask(text, ["confirm"])
        while self.answered() is None:
            time.sleep(BETWEEN_LINES / 10.0)

    def repeats(self, text: str) -> bool:
        self.ask(text, ["repeat_point", "keep"])
        while (answer := self.answered()) is None:
            time.sleep(BETWEEN_LINES / 10.0)
        return answer == "repeat_point"

    def ask(self, text: str, answers: list[Control]) -> None:
        self._clear()
        self._answers = answers
        if answers == ["confirm"]:
            click.echo(f"{plain(in_flags(text))}: Enter", nl=self._is_terminal)  # what is read stands below it
            self._is_open = not self._is_terminal
        else:
            self.tell(f"warning: {text}")
            if sys.stdin.isatty():
                click.echo("repeat [r], keep [k]: ", nl=self._is_terminal)
        sys.stdout.flush()

    def answered(self) -> Control | None:
        if self._answers != ["confirm"] and not sys.stdin.isatty():
            return "keep"  # nobody to ask
        line = self._typed_line()
        if line is None:
            return None
        if not sys.stdin.isatty():
            self._clear()  # a terminal shows the Enter itself
        if self._answers == ["confirm"]:
            return "confirm"
        answer = _KEYS.get(line.strip().lower())
        if answer is None:
            click.echo("repeat [r], keep [k]: ", nl=False)
            sys.stdout.flush()
        return answer

    def withdraw(self) -> None:
        click.echo(" – answered elsewhere")

    def show(self, state: LiveState) -> None:
        if not self._is_terminal:
            super().show(state)
            return
        now = time.monotonic()
        if state.doing == "ended" or now - self._shown < BETWEEN_LINES:
            return
        self._shown = now
        text = plain(status_line(state))[: max(20, os.get_terminal_size().columns - 1)]
        click.echo(f"\r{text.ljust(self._width)}", nl=False)
        self._width = len(text)
        sys.stdout.flush()

    def _clear(self) -> None:
        if self._is_open:
            click.echo()
            self._is_open = False
        if self._width:
            click.echo("\r" + " " * self._width + "\r", nl=False)
            self._width = 0

    def _typed_line(self) -> str | None:
        """A line that was typed, if it is whole. Raises InvalidArgument at the end of standard input."""
        ended = "standard input ended before Enter was pressed; --resume continues"
        try:
            number = sys.stdin.fileno()
        except (AttributeError, OSError, ValueError):  # no file, such as in a notebook
            line = sys.stdin.readline()
            if not line:
                raise InvalidArgument(ended) from None
            return line
        typed = of_standard_input(number)
        if b"\n" not in self._typed and select.select([typed], [], [], 0.0)[0]:
            data = typed.read(4096)
            if not data:
                raise InvalidArgument(ended)
            self._typed += data
        line, end, rest = self._typed.partition(b"\n")
        if not end:
            return None
        self._typed = rest
        return line.decode(errors="replace")


def status_line(state: LiveState) -> str:
    """What happens, in one line."""
    if state.limit_urad is not None:
        return _alignment_line(state)
    done = round(BAR * (state.index + (state.doing == "reads")) / max(state.points, 1))
    bar = "█" * done + "·" * (BAR - done)
    if state.reasons:
        beside = f"NO BEAM ({state.reasons[0]})" if state.distance_mm is None else state.reasons[0]
    elif state.from_nominal_um is not None and abs(state.from_nominal_um) < 1e3:
        beside = f"{state.from_nominal_um:+9.3f} µm from nominal"
    else:
        beside = "" if state.distance_mm is None else f"{state.distance_mm:.4f} mm"
    left = "" if state.minutes_left is None else f", {state.minutes_left:.0f} min left"
    lost = f", {state.lost} lost" if state.lost else ""
    return (
        f"{state.line} {bar} point {state.point} {state.doing} {beside} | {state.readings} of {state.planned} "
        f"readings{lost}{left}"
    )


def _alignment_line(state: LiveState) -> str:
    """While head and mirror are aligned."""
    parts = [state.line]
    if state.cross_urad is not None:
        right, up = state.cross_urad
        size = (right**2 + up**2) ** 0.5
        word = "within" if size <= (state.limit_urad or 0.0) else "above"
        sideways, upward = ("left" if right < 0.0 else "right"), ("down" if up < 0.0 else "up")
        parts.append(
            f"mirror to beam {abs(right):.0f} µrad {sideways}, {abs(up):.0f} {upward}, {word} {state.limit_urad:.0f}"
        )
    if state.distance_mm is not None:
        parts.append(f"{state.distance_mm:.4f} mm")
    parts += [f"{name} {value:.0f}" for name, value in state.signal.items()]
    return " | ".join([*parts, *(["NO BEAM"] if state.distance_mm is None and not state.signal else [])])
