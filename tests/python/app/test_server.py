"""The application: who is let in, what a page can reach, and that its changes are commands on the book."""

import math
import re
import shlex
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import httpx
import pytest
from starlette.testclient import TestClient

import stepdiag as sd
from stepdiag.app import security
from stepdiag.app.machine_drawing import plan_figure, planned_lines
from stepdiag.app.routes import application
from stepdiag.cli import main

PORT, TOKEN = 8765, "first-address"
ORIGIN = f"http://127.0.0.1:{PORT}"
MACHINE = Path("book/machines/VMC-1200")


def run(*arguments: str) -> int:
    return main(list(arguments))


@pytest.fixture
def stranger(book: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client that has not opened the first address."""
    app = application(book / "book", tmp_path_factory.mktemp("pages"), PORT, TOKEN)
    with TestClient(app, base_url=ORIGIN, follow_redirects=False) as client:
        yield client


@pytest.fixture
def person(stranger: TestClient) -> TestClient:
    """The person who did, whose browser sends the origin with every change."""
    assert stranger.get(f"/enter?token={TOKEN}").status_code == 303
    stranger.headers["Origin"] = ORIGIN
    return stranger


def ended(client: TestClient, answer: httpx.Response) -> dict[str, object]:
    """The state of the command that a change has begun, at its end."""
    assert answer.status_code == 303
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        state: dict[str, object] = client.get(f"{answer.headers['location']}/state").json()
        if state["status"] is not None:
            return state
        time.sleep(0.05)
    raise AssertionError("the command has not ended")


# --- who is let in ---------------------------------------------------------------------------------------------------
CHANGES = (
    "/machines",
    "/machines/VMC-1200/files?name=a.csv",
    "/machines/VMC-1200/evaluate",
    "/machines/VMC-1200/remove",
    "/machines/VMC-1200/begin",
    "/machines/VMC-1200/live/align/control",
)
SCREENS = ("/", "/machines/VMC-1200", "/machines/VMC-1200/file/runs/run.csv", "/search?q=a", "/static/app.js")
SCREENS += ("/machines/VMC-1200/measure", "/machines/VMC-1200/live/align", "/machines/VMC-1200/live/align/events")


@pytest.mark.parametrize("address", SCREENS)
def test_nothing_is_shown_without_the_cookie(stranger: TestClient, address: str) -> None:
    assert stranger.get(address).status_code == 401
    stranger.cookies.set(f"stepdiag-{PORT}", "guessed")
    assert stranger.get(address).status_code == 401


def test_cookie_is_given_for_the_token_alone_and_to_same_site_requests_only(stranger: TestClient) -> None:
    for wrong in ("", "?token=", "?token=first-addres", "?token=%00", "?token=é", "?tok=first-address"):
        assert stranger.get(f"/enter{wrong}").status_code == 401
    answer = stranger.get(f"/enter?token={TOKEN}")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/"
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert "domain" not in cookie


@pytest.mark.parametrize(
    "host",
    ["example.com", f"example.com:{PORT}", "127.0.0.1", "127.0.0.1:1", f"127.0.0.1.example.com:{PORT}", "", "[::1]"],
)
def test_other_names_of_this_computer_are_refused(person: TestClient, host: str) -> None:
    """As a page whose name was bound to 127.0.0.1 would ask (DNS rebinding), also with the cookie."""
    assert person.get("/", headers={"Host": host}).status_code == 421
    assert person.post("/machines", headers={"Host": host}, data={"name": "X"}).status_code == 421
    assert not Path("book/machines/X").exists()


@pytest.mark.parametrize("address", CHANGES)
@pytest.mark.parametrize(
    "origin",
    [
        None,
        "null",
        "http://example.com",
        "http://127.0.0.1:1",
        f"https://127.0.0.1:{PORT}",
        f"{ORIGIN}.example.com",
        "",
    ],
)
def test_changes_from_other_pages_are_refused(person: TestClient, address: str, origin: str | None) -> None:
    del person.headers["Origin"]
    headers = {} if origin is None else {"Origin": origin}
    before = sorted(path.name for path in Path("book").rglob("*"))
    assert person.post(address, headers=headers, data={"name": "X", "file": "runs/run.csv"}).status_code == 403
    assert sorted(path.name for path in Path("book").rglob("*")) == before


def test_websockets_are_guarded_too(person: TestClient) -> None:
    from starlette.websockets import WebSocketDisconnect

    with (
        pytest.raises(WebSocketDisconnect),
        person.websocket_connect("/live", headers={"Origin": "http://example.com"}),
    ):
        pass


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"])
def test_other_methods_do_nothing(person: TestClient, method: str) -> None:
    assert person.request(method, "/machines/VMC-1200/remove").status_code == 405


@pytest.mark.parametrize("address", SCREENS)
def test_every_answer_has_the_policy(person: TestClient, address: str) -> None:
    headers = person.get(address).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store"
    assert "access-control-allow-origin" not in headers


def test_pages_have_no_script_or_style_within(person: TestClient) -> None:
    for address in ("/", "/machines/VMC-1200", "/search?q=run"):
        text = person.get(address).text
        assert " style=" not in text
        assert "<style" not in text
        assert not re.search(r"<[^>]*\son\w+\s*=", text), "an event handler"
        assert text.count("<script") == text.count('<script type="module" src="/static/app.js">') == 1
        assert "http://" not in text
        assert "https://" not in text


# --- what a request can reach ----------------------------------------------------------------------------------------
OUTSIDE = (
    "/machines/VMC-1200/file/../../../BOOK.txt",
    "/machines/VMC-1200/file/..%2F..%2F..%2FBOOK.txt",
    "/machines/VMC-1200/file/%2e%2e/%2e%2e/BOOK.txt",
    "/machines/VMC-1200/file//etc/passwd",
    "/machines/VMC-1200/file/machine.toml",
    "/machines/VMC-1200/file/runs/run.csv%00",
    "/machines/VMC-1200/file/runs%5crun.csv",
    "/machines/..%2F..%2F/file/BOOK.txt",
    "/machines/..%2F..",
    "/static/../server.py",
    "/static/..%2Fserver.py",
    "/static/server.py",
)


@pytest.mark.parametrize("address", OUTSIDE)
def test_no_address_leads_out_of_the_list_of_files(person: TestClient, address: str) -> None:
    answer = person.get(address)
    assert answer.status_code in (404, 405)
    assert "machine book of stepdiag" not in answer.text
    assert "root:" not in answer.text


def test_path_in_the_name_of_an_upload_leads_nowhere(person: TestClient) -> None:
    answer = person.post("/machines/VMC-1200/files", params={"name": "../../../x/evil.csv"}, content=b"line,point\n")
    state = ended(person, httpx.Response(303, headers={"location": answer.json()["job"]}))
    assert state["status"] == 2
    assert not list(Path().rglob("*evil*"))


def test_too_large_bodies_are_refused(person: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    assert person.post("/machines", content=b"name=" + b"x" * security.LARGEST_FORM).status_code == 413

    def endless() -> Iterator[bytes]:
        for _ in range(100):
            yield b"x" * 2**12

    assert person.post("/machines", content=endless()).status_code == 413  # has no length
    monkeypatch.setattr(security, "LARGEST_UPLOAD", 1000)
    for content in (b"x" * 1001, endless()):
        answer = person.post("/machines/VMC-1200/files", params={"name": "a.csv"}, content=content)
        assert answer.status_code == 413
    assert sorted(path.name for path in (MACHINE / "runs").iterdir()) == ["run.csv"]


def test_text_of_files_and_names_is_text(person: TestClient) -> None:
    evil = "<img src=x onerror=alert(1)>"
    about = MACHINE / "machine.toml"
    about.write_text(about.read_text().replace("# notes =", f'notes = "{evil}"'))
    for address in ("/", "/machines/VMC-1200", f"/search?q={evil}", "/machines/%3Cimg%20src=x%3E"):
        assert "<img" not in person.get(address).text


def test_words_of_a_form_are_no_options(person: TestClient) -> None:
    state = ended(person, person.post("/machines", data={"name": "--help", "title": "--book=/tmp"}))
    assert state["status"] == 2
    assert sorted(path.name for path in Path("book/machines").iterdir()) == ["VMC-1200"]


# --- what it is for --------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_path_from_a_new_machine_to_the_report(person: TestClient, book: Path) -> None:
    form = {"name": "Fräse 3", "limit": "60", "title": "VMC 800", "head": "beam_and_psd", "chain": "[w X' Y' b Z t]"}
    form |= {"travel_x": "400", "travel_y": "300", "travel_z": "250.5", "distance_noise": "0.2", "tilt_noise": "2"}
    state = ended(person, person.post("/machines", data=form))
    assert state == {"status": 0, "doing": "", "share": None, "next": "/machines/Fr%C3%A4se%203"}
    made = sd.read_scenario("book/machines/Fräse 3/scenarios/scenario.toml").known
    assert (made.chain.name, list(made.plan.volume)) == ("[w X' Y' b Z t]", [400.0, 300.0, 250.5])
    machine = str(state["next"])
    answer = person.post(
        f"{machine}/plans", data={"what": "nc", "scenario": "scenarios/scenario.toml", "dialect": "iso"}
    )
    assert ended(person, answer)["status"] == 0
    assert "plans/" in person.get(answer.headers["location"]).text
    for name in ("scenario.toml", "run.csv"):
        answer = person.post(f"{machine}/files", params={"name": name}, content=Path(name).read_bytes())
        ended(person, httpx.Response(303, headers={"location": answer.json()["job"]}))
    assert "70 points on 7 lines" in person.get(machine).text
    state = ended(person, person.post(f"{machine}/evaluate", data={"run": "runs/run.csv"}))
    shown = person.get(str(state["next"])).headers["location"]
    page = person.get(shown).text
    assert "Doubtful" in page
    assert "times the stated one" in page
    assert 'data-above="' in page
    figures = person.get(shown.replace("/calibration/", "/figures/"))
    assert figures.text.startswith("<!DOCTYPE html>")
    assert "sandbox" in figures.headers["content-security-policy"]
    file = f"calibrations/{shown.rsplit('/', 1)[1]}"
    report = {"file": file, "customer": "Müller & Söhne", "ending": ".html"}
    state = ended(person, person.post(f"{machine}/reports", data=report))
    assert state["status"] == 0
    (made,) = Path("book/machines/Fräse 3/reports").iterdir()
    assert "Müller &amp; Söhne" in made.read_text()


def test_commands_that_a_screen_shows_do_the_same(person: TestClient, capsys: pytest.CaptureFixture[str]) -> None:
    answer = person.post("/machines/VMC-1200/evaluate", data={"run": "runs/run.csv"})
    ended(person, answer)
    text = person.get(answer.headers["location"]).text
    command = text.split("<li><code>")[1].split("</code>")[0].replace("&#x27;", "'")
    assert run(*shlex.split(command)[1:]) == 0
    assert len([*(MACHINE / "calibrations").iterdir()]) == 2


def test_remove_and_restore(person: TestClient) -> None:
    assert ended(person, person.post("/machines/VMC-1200/remove", data={"file": "runs/run.csv"}))["status"] == 0
    assert not (MACHINE / "runs/run.csv").exists()
    assert "Bin (1)" in person.get("/machines/VMC-1200").text
    assert ended(person, person.post("/machines/VMC-1200/restore", data={"file": "bin/runs/run.csv"}))["status"] == 0
    assert (MACHINE / "runs/run.csv").exists()


def test_failure_of_a_command_is_shown(person: TestClient) -> None:
    answer = person.post("/machines", data={"name": "VMC-1200"})
    assert ended(person, answer)["status"] == 2
    assert "exists already" in person.get(answer.headers["location"]).text


@pytest.mark.slow
def test_long_command_can_be_stopped(person: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepdiag.app.jobs.COMMAND", ("-c", "import time; time.sleep(60)"))
    answer = person.post("/machines/VMC-1200/evaluate", data={"run": "runs/run.csv"})
    job = answer.headers["location"]
    assert person.get(f"{job}/state").json()["status"] is None
    assert "Stop" in person.get(job).text
    start = time.monotonic()
    assert person.post(f"{job}/stop").status_code == 303
    assert time.monotonic() - start < 5.0
    assert "Stopped" in person.get(job).text


def test_damaged_files_are_shown_as_such(person: TestClient) -> None:
    (MACHINE / "calibrations").mkdir()
    (MACHINE / "calibrations/broken.nc").write_bytes(b"\x89HDF")
    assert "damaged" in person.get("/machines/VMC-1200").text
    assert person.get("/machines/VMC-1200/calibration/broken.nc").status_code == 404


def test_without_the_packages_one_line_says_what_to_install(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert run("app", "book") == 2
    assert "pip install 'stepdiag[app]'" in capsys.readouterr().err


def test_compensation_asks_for_the_present_table_and_leads_back(person: TestClient) -> None:
    machine = "/machines/VMC-1200"
    ended(person, person.post(f"{machine}/evaluate", data={"run": "runs/run.csv"}))
    (made,) = (MACHINE / "calibrations").iterdir()
    screen = f"{machine}/compensate/{made.name}"
    assert person.get(screen).status_code == 200
    form = {"file": f"calibrations/{made.name}", "to": "squareness"}
    refused = person.post(f"{machine}/exports", data=form)
    assert refused.status_code == 404
    assert "First keep the table that the controller has now" in refused.text
    before = b"0.0 0.0 0.0\n100.0 0.001 0.001\n"
    answer = person.post(f"{machine}/files", params={"name": "x.comp"}, content=before)
    ended(person, httpx.Response(303, headers={"location": answer.json()["job"]}))
    answer = person.post(f"{machine}/exports", data={**form, "replaces": "exports/x.comp"})
    assert ended(person, answer)["status"] == 0
    assert "largest error in the volume" in person.get(answer.headers["location"]).text, "what remains"
    text = person.get(screen).text
    assert "Bring back x.comp" in text
    assert person.get(f"{machine}/file/exports/x.comp").content == before
    table = next(path for path in (MACHINE / "exports").iterdir() if path.suffix == ".csv")
    answer = person.post(f"{machine}/files", params={"name": "read.csv"}, content=table.read_bytes())
    ended(person, httpx.Response(303, headers={"location": answer.json()["job"]}))
    assert f"already in the book as exports/{table.name}" in person.get(answer.json()["job"]).text
    answer = person.post(f"{machine}/exports", data={**form, "replaces": "none", "to": "siemens-cec", "proof": "yes"})
    state = ended(person, answer)
    shown = person.get(answer.headers["location"]).text
    assert state["status"] == 0, shown
    assert "proof of the sign: " in shown
    assert "sign-siemens-cec.mpf" in shown
    assert "Measuring program to prove a sign" in (MACHINE / "plans/sign-siemens-cec.mpf").read_text()


def test_trend_screen(person: TestClient) -> None:
    machine = "/machines/VMC-1200"
    assert "No calibration that can be used" in person.get(f"{machine}/trend").text
    ended(person, person.post(f"{machine}/evaluate", data={"run": "runs/run.csv"}))
    assert "C0Y, squareness of Y to X" in person.get(f"{machine}/trend").text


def test_pictures_alone_are_shown_in_place(person: TestClient) -> None:
    (MACHINE / "plans").mkdir()
    (MACHINE / "plans/plans.png").write_bytes(b"\x89PNG\r\n\x1a\n1234")
    (MACHINE / "plans/evil.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'><script>1</script></svg>")
    shown = person.get("/machines/VMC-1200/picture/plans/plans.png")
    assert (shown.status_code, shown.headers["content-type"]) == (200, "image/png")
    for file in ("plans/evil.svg", "runs/run.csv", "../../BOOK.txt"):
        assert person.get(f"/machines/VMC-1200/picture/{file}").status_code == 404


def test_searched_plan_becomes_that_of_the_next_run(person: TestClient) -> None:
    """The page shows the latest scenario's plan; the search writes another one beside it."""
    few = 'steps = [5]\nrepeats = [1]\nline_sets = [["ppp", "npp", "p00"]]'
    Path("few.toml").write_text(f"{Path('scenario.toml').read_text()}[plan_by_time]\n{few}\n")
    assert run("book", "add", "--machine", "VMC-1200", "few.toml") == 0
    first = person.get("/machines/VMC-1200/plan").text
    assert '<option value="scenarios/few.toml" selected>' in first
    assert "front left low" in first
    given = {"what": "plan", "scenario": "scenarios/few.toml", "goal": "time", "minutes": "40", "write": "yes"}
    assert ended(person, person.post("/machines/VMC-1200/plans", data=given))["status"] == 0
    written = [path.name for path in (MACHINE / "scenarios").iterdir()]
    assert sorted(written) == ["few.toml", "plans.toml", "scenario.toml"]
    plan = sd.read_scenario(MACHINE / "scenarios/plans.toml").known.plan
    shown = person.get("/machines/VMC-1200/plan").text
    assert '<option value="scenarios/plans.toml" selected>' in shown
    assert f"{plan.steps} per axis" in shown
    other = person.get("/machines/VMC-1200/plan?scenario=scenarios/few.toml").text
    assert '<option value="scenarios/few.toml" selected>' in other


def test_heads_at_one_place_are_drawn_apart(book: Path) -> None:
    """Without a standoff they stand where the mirror is: nothing says in which direction to move their circles."""
    known = sd.read_scenario(book / "scenario.toml").known
    lines = [replace(one, head=one.first.positions[0]) for one in planned_lines(known)]
    shown = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', plan_figure(known, lines))
    places = [(float(x), float(y)) for x, y in shown]
    apart = [math.dist(a, b) for k, a in enumerate(places) for b in places[:k]]
    assert len(places) == len(lines)
    assert min(apart) > 22.0


def judged(name: str, fit: str, date: str) -> None:
    """A calibration of the book's run, of this verdict and day."""
    assert run("evaluate", "scenario.toml", "run.csv", "-o", f"{name}.nc") == 0
    sd.read_calibration(f"{name}.nc").judged(fit, ["of the test"]).dated(date).write(f"{name}.nc")
    assert run("book", "add", "--machine", "VMC-1200", f"{name}.nc") == 0


def test_doubtful_calibration_looks_so_wherever_its_machine_is_shown(
    person: TestClient, capsys: pytest.CaptureFixture[str]
) -> None:
    about = MACHINE / "machine.toml"
    about.write_text(about.read_text().replace("limit_um = 20.0", "limit_um = 500.0"))
    judged("good", "accepted", "2025-01-01T08:00:00Z")
    assert 'class="banner good"' in person.get("/machines/VMC-1200").text
    judged("odd", "doubtful", "2025-02-01T08:00:00Z")
    for address in ("/", "/machines/VMC-1200"):
        text = person.get(address).text
        assert "Do not rely on this: the fit of odd.nc is doubtful." in text
        assert 'class="banner good"' not in text
    capsys.readouterr()
    assert run("book", "list") == 0
    assert "do not rely on its verdict: the fit of odd.nc is doubtful" in capsys.readouterr().out


def test_latest_calibration_that_is_rejected_is_not_passed_over_in_silence(person: TestClient) -> None:
    judged("good", "accepted", "2025-01-01T08:00:00Z")
    judged("bad", "rejected", "2025-02-01T08:00:00Z")
    for address in ("/", "/machines/VMC-1200"):
        said = "Do not rely on this: the latest calibration, bad.nc, is rejected and does not count."
        assert said in person.get(address).text


def test_figures_follow_the_limit_of_the_machine(person: TestClient) -> None:
    judged("good", "accepted", "2025-01-01T08:00:00Z")
    figures = "/machines/VMC-1200/figures/good.nc"
    assert "Is the machine within 20" in person.get(figures).text
    about = MACHINE / "machine.toml"
    about.write_text(about.read_text().replace("limit_um = 20.0", "limit_um = 35.0"))
    assert "Is the machine within 35" in person.get(figures).text


# --- measuring -------------------------------------------------------------------------------------------------------
def test_page_starts_no_program_and_no_unknown_scenario(person: TestClient) -> None:
    scenario = next(path.name for path in (Path(MACHINE) / "scenarios").iterdir())
    given = {"what": "acquire", "scenario": f"scenarios/{scenario}", "trigger": "key"}
    answer = person.post("/machines/VMC-1200/begin", data={**given, "source": "program:touch owned"})
    assert answer.status_code == 404
    assert "starts no programs" in answer.text
    for wrong in ("../scenario.toml", "/etc/passwd", "runs/run.csv/.."):
        answer = person.post(
            "/machines/VMC-1200/begin", data={**given, "scenario": wrong, "source": "lines://127.0.0.1:1"}
        )
        assert answer.status_code == 404
    assert not Path("owned").exists()


@pytest.mark.parametrize("name", ["%2e%2e", ".", "../../x", "run%00", "nothing"])
def test_only_what_was_measured_can_be_watched(person: TestClient, name: str) -> None:
    for path in ("", "/events"):
        assert person.get(f"/machines/VMC-1200/live/{name}{path}").status_code in (404, 405)
    assert person.post(f"/machines/VMC-1200/live/{name}/control", data={"control": "stop"}).status_code in (404, 405)


def test_alignment_that_cannot_begin_says_why(person: TestClient) -> None:
    scenario = next(path.name for path in (Path(MACHINE) / "scenarios").iterdir())
    given = {"what": "align", "scenario": f"scenarios/{scenario}", "source": "lines://127.0.0.1:1"}
    answer = person.post("/machines/VMC-1200/begin", data=given)
    assert answer.status_code == 303
    page = answer.headers["location"]
    until = time.monotonic() + 30.0
    while "cannot be reached" not in (said := person.get(page).text):
        assert time.monotonic() < until, said
        time.sleep(0.1)
    assert person.get("/machines/VMC-1200/measure").status_code == 200
    control = page.partition("?")[0] + "/control"
    assert person.post(control, data={"control": "explode"}).status_code == 404
    assert "no acquisition is running" in person.post(control, data={"control": "stop"}).text
