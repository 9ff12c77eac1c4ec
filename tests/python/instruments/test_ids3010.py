"""The client of the IDS3010 understands an instrument, and says what is wrong with one that it does not."""

import contextlib
import json
import time
from collections.abc import Callable
from typing import Any

import pytest
from acquiring import instrument, reply, sound
from hypothesis import given
from hypothesis import strategies as st

from stepdiag.instruments.ids3010 import LARGEST_POSITION, Ids3010, Positions
from stepdiag.instruments.ids3010_messages import LARGEST, JsonStream
from stepdiag.instruments.instrument import InstrumentError

Request = dict[str, Any]


def client(address: tuple[str, int], **given: Any) -> Ids3010:
    return Ids3010(*address, **({"timeout": 10.0, "attempts": 1} | given))


def only(method: str, answer: Callable[[Request], bytes | None]) -> Callable[[Request], bytes | None]:
    """Sound, but for one function."""
    return lambda request: answer(request) if request["method"].endswith("." + method) else sound(request)


def test_requests_are_those_of_the_manufacturers_client() -> None:
    seen: list[Request] = []

    def answer(request: Request) -> bytes:
        seen.append(request)
        return sound(request)

    with instrument(answer) as address, client(address) as ids:
        ids.read((0, 1, 2))
    assert seen[-1] == {
        "jsonrpc": "2.0",
        "method": "com.attocube.ids.displacement.getAbsolutePositions",
        "params": [],
        "id": seen[-1]["id"],
        "api": 2,
    }
    assert seen[-1]["id"] == seen[-2]["id"] + 1


def test_positions_come_to_the_picometre() -> None:
    # The numbers of a real instrument, as a public log has them.
    answer = only("getAbsolutePositions", lambda r: reply(r, 0, 317284613292, 317246920666, 317563277236))
    with instrument(answer) as address, client(address) as ids:
        assert ids.read((0, 1, 2)) == Positions((317284613292, 317246920666, 317563277236), (0, 0, 0))
        assert ids.read((2, 0, 1)).pm == (317563277236, 317284613292, 317246920666)


def test_one_axis_is_asked_by_itself() -> None:
    with instrument(sound) as address, client(address) as ids:
        assert ids.read((1,)) == Positions((100_000_000_002,), (0,))


def test_warning_loses_the_axes_that_have_one_by_themselves() -> None:
    def answer(request: Request) -> bytes:
        method = request["method"].rsplit(".", 1)[-1]
        if method == "getAbsolutePositions":
            return reply(request, 17, 1, 2, 3)
        if method == "getAbsolutePosition":
            axis = request["params"][0]
            return reply(request, 17 if axis == 1 else 0, axis + 1)
        return sound(request)

    with instrument(answer) as address, client(address) as ids:
        assert ids.read((0, 1, 2)) == Positions((1, None, 3), (0, 17, 0))


def test_later_firmware_has_other_names() -> None:
    def answer(request: Request) -> bytes:
        if not request["method"].startswith("com.attocube.sen."):
            return json.dumps(
                {"jsonrpc": "2.0", "error": {"code": -32601, "message": "no"}, "id": request["id"]}
            ).encode()
        return sound(request)

    with instrument(answer) as address, client(address) as ids:
        assert ids.read((0, 1, 2)).pm[0] == 100_000_000_001
        assert ids.describe()["interface"] == "com.attocube.sen"


def test_pieces_of_a_reply_are_put_together() -> None:
    stream = JsonStream()
    pieces = [stream.feed(bytes([byte])) for byte in b'{"id": 1, "result": [0, {"a": "}"}]}\r\n']
    assert [piece for piece in pieces if piece] == [[{"id": 1, "result": [0, {"a": "}"}]}]]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(
    objects=st.lists(st.dictionaries(st.text(), JSON, max_size=3), max_size=4),
    ends=st.lists(st.sampled_from([b"", b"\n", b"\r\n", b" "]), min_size=4, max_size=4),
    cuts=st.lists(st.integers(0, 400), max_size=6),
    plain=st.booleans(),
)
def test_objects_are_the_same_wherever_a_stream_is_cut(
    objects: list[Request], ends: list[bytes], cuts: list[int], plain: bool
) -> None:
    data = b"".join(
        json.dumps(each, ensure_ascii=plain).encode() + end for each, end in zip(objects, ends, strict=False)
    )
    stream, found, last = JsonStream(), [], 0
    for cut in [*sorted(min(cut, len(data)) for cut in cuts), len(data)]:
        found += stream.feed(data[last:cut])
        last = cut
    assert found == objects


@given(data=st.binary(max_size=200))
def test_any_bytes_are_objects_or_refused(data: bytes) -> None:
    with contextlib.suppress(ValueError):
        assert all(isinstance(each, dict) for each in JsonStream().feed(data))


@pytest.mark.parametrize(
    "data", [b"[1]\n", b"HTTP/1.1 400 Bad Request\r\n", b'{"a": NaN}\n', b"{" * 70_000, b"{" * 3000 + b"\n"]
)
def test_streams_of_something_else_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="'"):  # which shows what came
        JsonStream().feed(data)


def test_stream_without_an_end_is_refused() -> None:
    stream = JsonStream()
    stream.feed(b'{"a": "' + b"x" * (LARGEST - 10))
    with pytest.raises(ValueError, match="xxx"):
        stream.feed(b"x" * 10)


def error_of(answer: Callable[[Request], bytes | None], **given: Any) -> str:
    with instrument(answer) as address, client(address, timeout=0.3, **given) as ids:
        with pytest.raises(InstrumentError) as error:
            ids.read((0, 1, 2))
        assert str(error.value).startswith(f"ids3010://127.0.0.1:{address[1]}: ")
        return str(error.value)


def late(request: Request) -> bytes:
    time.sleep(0.8)
    return sound(request)


def other_id(request: Request) -> bytes:
    return sound(request | {"id": request["id"] + 1000})


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda r: b"", "no answer within 0.3 s"),
        (lambda r: b'{"jsonrpc": "2.0", "resu', "no answer within 0.3 s"),
        (late, "no answer within 0.3 s"),
        (lambda r: None, "the connection was closed"),
        (other_id, "no answer within 0.3 s, only 1 with other ids"),
        (lambda r: b"HTTP/1.1 400 Bad Request\r\n", "expected a JSON-RPC reply, got 'HTTP/1.1 400 Bad Request"),
        (lambda r: b"\xff\xfe\x00\n", "expected a JSON-RPC reply"),
        (lambda r: b"{" * 5000 + b"\n", "expected a JSON-RPC reply"),
        (lambda r: json.dumps({"id": r["id"]}).encode(), "expected a reply with a result"),
        (lambda r: json.dumps({"id": r["id"], "result": {}}).encode(), "expected a reply with a result"),
        (lambda r: json.dumps({"id": r["id"], "result": []}).encode(), "expected a reply with a result"),
        (lambda r: reply(r, 0, 1, 2), "expected a warning number and 3 positions in pm, got [0, 1, 2]"),
        (lambda r: reply(r, 0, 1, 2, 3, 4), "expected a warning number and 3 positions"),
        (lambda r: reply(r, 0, 1.5, 2, 3), "expected a warning number and 3 positions"),
        (lambda r: reply(r, 0, "1", 2, 3), "expected a warning number and 3 positions"),
        (lambda r: reply(r, 0, None, 2, 3), "expected a warning number and 3 positions"),
        (lambda r: reply(r, 0, True, 2, 3), "expected a warning number and 3 positions"),
        (lambda r: reply(r, None, 1, 2, 3), "expected a warning number and 3 positions"),
        (lambda r: reply(r, 0, LARGEST_POSITION, 2, 3), "expected a warning number and 3 positions"),
        (lambda r: json.dumps({"id": r["id"], "error": {"code": -1, "message": "no way"}}).encode(), "no way"),
        (lambda r: json.dumps({"id": r["id"], "error": "no way"}).encode(), "no way"),
    ],
)
def test_instrument_that_answers_nonsense_is_told_so(answer: Callable[[Request], bytes | None], message: str) -> None:
    assert message in error_of(only("getAbsolutePositions", answer))


def test_positions_with_a_point_are_whole_numbers() -> None:
    with (
        instrument(only("getAbsolutePositions", lambda r: reply(r, 0, 1.0, 2e11, 3))) as address,
        client(address) as ids,
    ):
        assert ids.read((0, 1, 2)).pm == (1, 200_000_000_000, 3)


def test_late_answer_is_not_taken_for_the_next() -> None:
    asked: list[int] = []

    def answer(request: Request) -> bytes:
        asked.append(request["id"])
        if len(asked) == 1:
            time.sleep(1.0)
            return reply(request, 0, 1, 1, 1)
        return reply(request, 0, 2, 2, 2)

    with instrument(only("getAbsolutePositions", answer)) as address, client(address, timeout=0.5, attempts=3) as ids:
        assert ids.read((0, 1, 2)).pm == (2, 2, 2)


def test_broken_connection_is_made_anew() -> None:
    asked: list[int] = []

    def answer(request: Request) -> bytes | None:
        asked.append(request["id"])
        return None if len(asked) in (1, 2, 5) else reply(request, 0, len(asked), 0, 0)

    with instrument(only("getAbsolutePositions", answer)) as address, client(address, attempts=3) as ids:
        assert [ids.read((0, 1, 2)).pm[0] for _ in range(3)] == [3, 4, 6]


def test_commands_are_sent_once() -> None:
    asked: list[str] = []

    def answer(request: Request) -> bytes | None:
        asked.append(request["method"])
        return None

    with (
        instrument(only("stopMeasurement", answer)) as address,
        client(address, attempts=3) as ids,
        pytest.raises(InstrumentError, match="the connection was closed"),
    ):
        ids.start(1.0)
    assert asked == ["com.attocube.ids.system.stopMeasurement"]


def test_measurement_that_does_not_start_is_told_with_the_instruments_error() -> None:
    def answer(request: Request) -> bytes:
        method = request["method"].rsplit(".", 1)[-1]
        if method == "getCurrentMode":
            return reply(request, 0, "system idle")
        if method == "getSystemError":
            return reply(request, 77)
        if method == "errorNumberToString":
            return reply(request, 0, "too little light")
        return reply(request, 0)

    told = "it stays in 'system idle'; it reports number 77: too little light"
    with instrument(answer) as address, client(address) as ids, pytest.raises(InstrumentError, match=told):
        ids.start(0.1)


def test_error_of_a_command_is_told_in_words() -> None:
    def answer(request: Request) -> bytes:
        method = request["method"].rsplit(".", 1)[-1]
        if method == "stopMeasurement":
            return reply(request, 5)
        return reply(request, 0, "not now") if method == "errorNumberToString" else sound(request)

    told = r"system.stopMeasurement: error number 5: not now"
    with instrument(answer) as address, client(address) as ids, pytest.raises(InstrumentError, match=told):
        ids.start(1.0)


def test_instrument_that_is_not_there_is_told() -> None:
    with instrument(sound) as address:
        pass
    with client(address) as ids, pytest.raises(InstrumentError, match="cannot be reached: "):
        ids.mode()


def test_instrument_that_knows_neither_interface_is_told() -> None:
    def answer(request: Request) -> bytes:
        return json.dumps({"error": {"code": -32601, "message": "no"}, "id": request["id"]}).encode() + b"\n"

    assert "knows neither com.attocube.ids nor com.attocube.sen" in error_of(answer)


def test_reply_behind_a_flood_of_others_is_not_waited_for() -> None:
    """5,000 replies with other ids before each: refused at the first request, not after minutes."""
    other = json.dumps({"jsonrpc": "2.0", "result": [0, "nothing"], "id": -1}).encode() + b"\r\n"

    def flooding(request: Request) -> bytes:
        return other * 5000 + sound(request)

    began = time.monotonic()
    with (
        instrument(flooding) as address,
        client(address) as ids,
        pytest.raises(InstrumentError, match="more than 100 replies with other ids"),
    ):
        ids.mode()
    assert time.monotonic() - began < 10.0  # its time limit


def test_mode_that_is_no_word_is_refused() -> None:
    answer = only("getCurrentMode", lambda r: reply(r, 0, "\x1b[2Jmeasurement running"))
    with (
        instrument(answer) as address,
        client(address) as ids,
        pytest.raises(InstrumentError, match="expected a mode in words"),
    ):
        ids.mode()
