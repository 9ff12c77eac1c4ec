"""Commands that a page has started: each a process of its own, so that no page waits for it and it can be stopped."""

import asyncio
import os
import re
import secrets
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from urllib.parse import quote

from stepdiag.platform import OWN_GROUP, exit_code, interrupt

_PROGRESS: Final = re.compile(r"stepdiag: progress: (.*?)(?: (\d+)/(\d+))?$")
_KEPT: Final = re.compile(r"(?:stepdiag: note: |.*: )(?:kept as|already in the book as) (\S.*)$")
COMMAND: Final = ("-m", "stepdiag")
MOST_ATTEMPTS: Final = 12  # to stop a command
BETWEEN: Final = 0.4  # s
MOST_LINES: Final = 500
MOST_JOBS: Final = 100  # that are remembered


class CommandJob:
    """Commands one after the other, until one fails.

    machine: whose files they change; empty: none's. then: the address to go to, where {file} is the last result.
    uploaded: a folder that is not needed afterwards."""

    def __init__(
        self,
        title: str,
        commands: Sequence[Sequence[str]],
        folder: Path,
        machine: str = "",
        then: str = "",
        uploaded: Path | None = None,
    ) -> None:
        self.id = secrets.token_urlsafe(9)
        self.title, self.commands, self.machine = title, commands, machine
        self._folder, self._then = folder, then
        self.status: int | None = None  # exit code, once all is done
        self.said: list[str] = []
        self.doing = ""
        self.share: float | None = None  # of what it is doing, 0 to 1
        self.kept: list[str] = []  # files of the machine that it made
        self._process: asyncio.subprocess.Process | None = None
        self._stopped, self._uploaded = False, uploaded
        self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def next(self) -> str:
        """The address of the result; empty while there is none."""
        if self.status not in (0, 3) or ("{file}" in self._then and not self.kept):
            return ""
        return self._then.replace("{file}", quote(self.kept[-1]) if self.kept else "")

    async def stop(self) -> None:
        """As Ctrl-C does: again and again, as the process may just begin; at last it is killed."""
        self._stopped = True
        for attempt in range(MOST_ATTEMPTS):
            if self._process is not None and self._process.returncode is None:
                interrupt(self._process.pid) if attempt < MOST_ATTEMPTS - 1 else self._process.kill()
            if (await asyncio.wait([self._task], timeout=BETWEEN))[0]:
                return
        await self._task

    async def _run(self) -> None:
        status = 0
        for words in self.commands:
            own = 130 if self._stopped else await self._one(words)
            own = 130 if self._stopped and own not in (0, 3) else own  # however early it came
            status = own if own not in (0, 3) else max(status, own)
            if status not in (0, 3):
                break
        if self._uploaded is not None:
            shutil.rmtree(self._uploaded, ignore_errors=True)
        self.status = status

    async def _one(self, words: Sequence[str]) -> int:
        self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            *COMMAND,
            *words,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            cwd=self._folder,
            env={**os.environ, "STEPDIAG_PROGRESS": "lines", "NO_COLOR": "1"},
            limit=2**20,
            **OWN_GROUP,
        )
        streams = (self._process.stdout, self._process.stderr)
        await asyncio.gather(*(self._read(stream) for stream in streams if stream is not None))
        return exit_code(await self._process.wait())

    async def _read(self, stream: asyncio.StreamReader) -> None:
        while line := await stream.readline():
            text = line.decode(errors="replace").rstrip()
            progress = _PROGRESS.fullmatch(text)
            if progress is not None:
                self.doing = progress[1]
                self.share = int(progress[2]) / max(int(progress[3]), 1) if progress[2] else None
                continue
            kept = _KEPT.fullmatch(text)
            if kept is not None:
                self.kept.append(kept[1])
            if len(self.said) < MOST_LINES:
                self.said.append(text)


class Jobs:
    """All jobs of a server, the last ones remembered."""

    def __init__(self) -> None:
        self._jobs: dict[str, CommandJob] = {}

    def add(self, job: CommandJob) -> CommandJob:
        self._jobs[job.id] = job
        for old in [one for one in self._jobs.values() if one.status is not None][:-MOST_JOBS]:
            del self._jobs[old.id]
        return job

    def get(self, identifier: str) -> CommandJob | None:
        return self._jobs.get(identifier)

    async def stop_all(self) -> None:
        await asyncio.gather(*(job.stop() for job in self._jobs.values() if job.status is None))
