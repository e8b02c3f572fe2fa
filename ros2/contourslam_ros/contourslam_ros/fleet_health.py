"""How the fleet is, in a few lines: who speaks, who does not, what was joined and why, and what could not be used."""

import threading
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from contourslam.fleet.common import Joined
from contourslam.fleet.facts import Answer
from contourslam.fleet.faults import Fault
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.figures import Rate

REMEMBER = 10.0  # s, for what comes in a second and for what was wrong of late
Name = tuple[str, int]


@dataclass
class Voice:
    """What was heard of one run of a robot; changed in place."""

    last: float
    packets: Rate = field(default_factory=lambda: Rate(REMEMBER))
    sizes: deque[tuple[float, int]] = field(default_factory=deque)

    def hear(self, size: int, now: float) -> None:
        """Count a packet."""
        self.last = now
        self.packets.count(now, now)
        self.sizes.append((now, size))
        self._forget(now)

    def speed(self, now: float) -> float:
        """Bytes a second of late, without what the network adds."""
        self._forget(now)
        return sum(size for _, size in self.sizes) / REMEMBER

    def _forget(self, now: float) -> None:
        while self.sizes and self.sizes[0][0] < now - REMEMBER:
            self.sizes.popleft()


@dataclass(frozen=True, slots=True)
class State:
    """What a server says of its fleet.

    Attributes
    ----------
    answers : tuple of Answer
        To every run.
    joined : tuple of Joined
    waiting, given_up : int
        Views that are still to be looked for, and that never will.
    """

    answers: tuple[Answer, ...] = ()
    joined: tuple[Joined, ...] = ()
    waiting: int = 0
    given_up: int = 0


class FleetHealth:
    """What the diagnostics of the server are made of; changed in place, told and asked from any thread.

    Parameters
    ----------
    topic : str
        On which the robots speak.
    silent_after : float
        Silence that is told of, s.
    """

    def __init__(self, topic: str, silent_after: float) -> None:
        self._topic, self._silent_after = topic, silent_after
        self._lock = threading.Lock()  # held for moments; all that follows is changed and read under it
        self._voices: dict[Name, Voice] = {}
        self._rubbish: deque[tuple[float, str]] = deque()
        self._refused, self._trouble = 0, ""
        self._kept: int | None = None  # reports, once they were counted since the last trouble

    def hear(self, name: Name, size: int, now: float) -> None:
        """Count a packet of a robot's run."""
        with self._lock:
            self._voices.setdefault(name, Voice(now)).hear(size, now)

    def refuse(self, why: str, now: float) -> None:
        """Count a packet that cannot be used."""
        with self._lock:
            self._refused += 1
            self._rubbish.append((now, why))

    def fail(self, why: str) -> None:
        """Take in that nothing can be kept."""
        with self._lock:
            self._trouble, self._kept = why, None

    def keep(self, reports: int) -> None:
        """Take in how many reports are kept: only where more are after a trouble is it over."""
        with self._lock:
            if self._kept is not None and reports > self._kept:
                self._trouble = ""
            self._kept = reports

    def heard_since(self, name: Name, then: float) -> bool:
        """Whether a run has spoken since."""
        with self._lock:
            voice = self._voices.get(name)
            return voice is not None and voice.last >= then

    def diagnostics(self, state: State, faults: Sequence[Fault], now: float) -> tuple[Diagnostic, ...]:
        """Say how all is.

        Parameters
        ----------
        state : State
        faults : sequence of Fault
        now : float
            s.
        """
        with self._lock:
            return (
                self._messages(now),
                self._robots(state.answers, now),
                *self._each(state.answers, now),
                _joints(state.joined),
                _search(state),
                _faults(faults),
            )

    def _messages(self, now: float) -> Diagnostic:
        while self._rubbish and self._rubbish[0][0] < now - REMEMBER:
            self._rubbish.popleft()
        rate = sum(voice.packets.by_arrival(now) for voice in self._voices.values())
        values = {"topic": self._topic, "a second": f"{rate:.2f}", "refused": str(self._refused)}
        if self._trouble:
            return Diagnostic(Level.ERROR, "messages", f"nothing is acknowledged: {self._trouble}", values)
        if self._rubbish:
            why = f"{len(self._rubbish)} refused in the last {REMEMBER:.0f} s, the last: {self._rubbish[-1][1]}"
            return Diagnostic(Level.WARN, "messages", why, values)
        return Diagnostic(Level.OK, "messages", f"{rate:.1f} a second", values)

    def _robots(self, answers: Sequence[Answer], now: float) -> Diagnostic:
        names = {answer.robot for answer in answers}
        maps = Counter(answer.common for answer in answers if answer.common > 0)
        values = {"robots": str(len(names)), "runs": str(len(answers)), "common maps": str(len(maps))}
        if not names:
            return Diagnostic(Level.OK, "robots", f"no robot has spoken yet on {self._topic}", values)
        last = {name: voice.last for name, voice in self._voices.items()}
        speaking = Counter(robot for (robot, _), when in last.items() if when > now - REMEMBER / 2.0)
        twice = sorted(robot for robot, count in speaking.items() if count > 1)
        if twice:
            return Diagnostic(
                Level.WARN,
                "robots",
                f"two speak as {' and '.join(twice)}: has it just been started again, or do two robots have one name?",
                values,
            )
        silent = sorted(names - {robot for (robot, _), when in last.items() if when > now - self._silent_after})
        if silent:
            text = f"{', '.join(silent)} silent for {self._silent_after:.0f} s: do they run, and are they in reach?"
            return Diagnostic(Level.WARN, "robots", text, values)
        text = f"{_number(len(names), 'robot')} in {_number(len(maps), 'common map')}"
        return Diagnostic(Level.OK, "robots", text, values)

    def _each(self, answers: Sequence[Answer], now: float) -> Iterator[Diagnostic]:
        newest: dict[str, Answer] = {}
        for answer in answers:
            voice = self._voices.get((answer.robot, answer.run))
            before = newest.get(answer.robot)
            if before is None or (voice is not None and voice.last >= self._last(before)):
                newest[answer.robot] = answer
        for robot, answer in sorted(newest.items()):
            voice = self._voices.get((robot, answer.run))
            runs = sum(other.robot == robot for other in answers)
            values = {
                "run": f"{answer.run:x}",
                "runs": str(runs),
                "reports": str(answer.received),
                "missing": str(len(answer.missing)),
                "keyframes": str(answer.keyframe + 1),
                "B/s": "0" if voice is None else f"{voice.speed(now):.0f}",
                "common map": str(answer.common),
            }
            others = [name for name in answer.members if name != robot]
            where = f"in common map {answer.common} " + (f"with {', '.join(others)}" if others else "by itself")
            level = Level.WARN if answer.missing else Level.OK
            lacks = f"; {len(answer.missing)} reports are missing and asked for" if answer.missing else ""
            placed = where if answer.keyframe >= 0 else "nothing of it is placed yet"
            yield Diagnostic(level, f"robot {robot}", placed + lacks, values)

    def _last(self, answer: Answer) -> float:
        voice = self._voices.get((answer.robot, answer.run))
        return 0.0 if voice is None else voice.last


def _joints(joined: Sequence[Joined]) -> Diagnostic:
    """Say what was joined to what, and on which evidence."""
    values = {}
    for one in joined:
        e = one.joint.evidence
        values[f"{', '.join(one.joining)} to {', '.join(one.members)}"] = (
            f"{len(one.joint.ties)} ties by {one.joint.method}, {e.corners} corners, {e.walls} walls, "
            f"{e.agreeing:.1f} m agree, {100.0 * e.contradicted:.1f} % contradicted, way {e.way:.1f} m, "
            f"rival {e.rival:.2f}"
        )
    return Diagnostic(Level.OK, "joints", f"{_number(len(joined), 'joint')} found", values)


def _search(state: State) -> Diagnostic:
    """Say whether the server keeps up with looking for joints."""
    values = {"waiting": str(state.waiting), "given up": str(state.given_up)}
    if state.given_up:
        text = f"{_number(state.given_up, 'view')} given up: more come than can be looked for; give the robots sites"
        return Diagnostic(Level.WARN, "search", text, values)
    return Diagnostic(Level.OK, "search", f"{_number(state.waiting, 'view')} to be looked for", values)


def _faults(faults: Sequence[Fault]) -> Diagnostic:
    if not faults:
        return Diagnostic(Level.OK, "faults", "all that was told could be used")
    last = faults[-1]
    text = f"{_number(len(faults), 'fault')}, the last of {last.robot}: {last.text}"
    return Diagnostic(Level.WARN, "faults", text, {"number": str(len(faults))})


def _number(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")
