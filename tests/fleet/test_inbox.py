"""Whatever the air and crashes do to messages, the server ends up with just what was told, each once and in order."""

import shutil
import tempfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, invariant, precondition, rule

from contourslam.errors import JournalError, MessageError
from contourslam.fleet import wire as wire_module
from contourslam.fleet.compact import Writer
from contourslam.fleet.facts import Answer, KeyframeFact, Report, Status
from contourslam.fleet.inbox import AHEAD, AHEAD_BYTES, TURNS, Inbox
from contourslam.fleet.journal import Journal
from contourslam.fleet.reporter_outbox import PATIENCE, Allowance, Outbox
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import HEAD, MAGIC, NUMBER_BITS, VERSION, encode
from contourslam.fleet.wire_facts import FACT, SIZES, take_facts

ROBOT = "robot1"


def fact(number: int, stamp: float = 0.0, points: int = 1) -> KeyframeFact:
    empty = np.zeros((0, 13), np.float32)
    return KeyframeFact(number, stamp, np.zeros(3), 0.0, np.ones((points, 4), np.float32), empty)


def report(number: int, run: int = 1, *, robot: str = ROBOT, stamp: float = 0.0, points: int = 1) -> bytes:
    return encode(Report(robot, run, number, (fact(number, stamp, points),)))


def status(reports: int, run: int = 1, *, robot: str = ROBOT, stamp: float = 0.0) -> bytes:
    return encode(Status(robot, run, reports, -1, np.zeros(3), stamp))


def numbers(inbox: Inbox, *messages: bytes) -> list[int]:
    return [told.number for data in messages for told in inbox.take(data).reports]


def again(inbox: Inbox, folder: Path) -> Inbox:
    """The server's program ends, and another one begins."""
    inbox.close()
    return Inbox(folder)


class Fleet(RuleBasedStateMachine):
    """Two robots that tell, an air that loses, repeats and mixes, a server; robots and server may die at any time."""

    air = Bundle("air")

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.now = 0.0
        self.robots = {name: [Outbox(100 + 10 * i)] for i, name in enumerate(("a", "b"))}
        self.inbox, self.got = Inbox(self.folder), dict[tuple[str, int], list[bytes]]()
        self.acknowledged: dict[tuple[str, int], int] = {}

    def teardown(self) -> None:
        self.inbox.close()
        shutil.rmtree(self.folder)

    @rule(name=st.sampled_from("ab"), points=st.integers(0, 3))
    def tell(self, name: str, points: int) -> None:
        box = self.robots[name][-1]
        number = len(box.reports)
        box.add(report(number, box.run, robot=name, points=points))

    @rule(name=st.sampled_from("ab"))
    def restart(self, name: str) -> None:
        """The program dies: what it had not sent for sure is lost with it; the next run is another one."""
        self.robots[name].append(Outbox(self.robots[name][-1].run + 1))

    @rule(target=air, name=st.sampled_from("ab"), wait=st.sampled_from([0.1, PATIENCE]))
    def send(self, name: str, wait: float) -> list[bytes]:
        self.now += wait
        allowance, box = Allowance(1e9), self.robots[name][-1]
        allowance.renew(self.now)
        return [*box.due(self.now, allowance), status(len(box.reports), box.run, robot=name)]

    @rule(sent=air, order=st.randoms(use_true_random=False), part=st.floats(0.0, 1.0))
    def arrive(self, sent: list[bytes], order: object, part: float) -> None:
        """Some of what was sent comes, perhaps again, perhaps late, in any order."""
        chosen = [data for data in sent if order.random() < part]  # type: ignore[attr-defined]
        order.shuffle(chosen)  # type: ignore[attr-defined]
        for data in chosen:
            self.take(data)

    @rule(sent=air, at=st.integers(0, 10**6))
    def arrive_damaged(self, sent: list[bytes], at: int) -> None:
        wrong = bytearray(sent[at % len(sent)])
        wrong[at % len(wrong)] ^= 1
        with pytest.raises(MessageError):
            self.inbox.take(bytes(wrong))

    @rule(name=st.sampled_from("ab"))
    def answer(self, name: str) -> None:
        box = self.robots[name][-1]
        self.inbox.settle()
        told = Answer(name, box.run, *self.inbox.state((name, box.run)), 0, (), -1, np.zeros(3), np.eye(3))
        box.answered(told)
        self.acknowledged[name, box.run] = told.received

    @rule(torn=st.integers(0, 30))
    def crash(self, torn: int) -> None:
        """The server dies, in the middle of writing a record; what it had acknowledged is there for the next one."""
        for path in self.folder.glob("*.facts"):
            with path.open("ab") as file:
                file.write(bytes(torn))
        self.inbox.close()
        self.inbox = Inbox(self.folder)
        assert bool(self.inbox.troubles) == bool(torn and list(self.folder.glob("*.facts")))
        self.got = {}
        for told in self.inbox.kept():
            self.got.setdefault((told.robot, told.run), []).append(encode(told))
        for source, received in self.acknowledged.items():
            assert len(self.got.get(source, [])) >= received

    def take(self, data: bytes) -> None:
        taken = self.inbox.take(data)
        assert taken.fault == ""
        for told in taken.reports:
            self.got.setdefault(taken.source, []).append(encode(told))

    @invariant()
    def all_that_was_got_is_what_was_told_in_order(self) -> None:
        for name, boxes in self.robots.items():
            for box in boxes:
                got = self.got.get((name, box.run), [])
                assert got == box.reports[: len(got)]

    @precondition(lambda self: any(boxes[-1].reports for boxes in self.robots.values()))
    @rule()
    def once_the_air_is_good_all_is_there(self) -> None:
        for name, boxes in self.robots.items():
            box, rounds = boxes[-1], 0
            while not box.settled or len(self.got.get((name, box.run), [])) < len(box.reports):
                rounds += 1
                assert rounds < 10
                for data in self.send(name, PATIENCE):
                    self.take(data)
                self.answer(name)
            assert self.got.get((name, box.run), []) == box.reports


Fleet.TestCase.settings = settings(max_examples=25, stateful_step_count=25, deadline=None)
TestNothingIsLostAndNothingIsDoubled = Fleet.TestCase


def test_what_comes_after_a_gap_waits_for_it_and_is_not_acknowledged() -> None:
    inbox = Inbox()
    assert numbers(inbox, report(0), report(2), report(3)) == [0]
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (1, (1,))
    assert numbers(inbox, report(1)) == [1, 2, 3]
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (4, ())


def test_a_repeated_report_gives_nothing_new() -> None:
    inbox = Inbox()
    assert numbers(inbox, report(0), report(0), report(2), report(2), report(1), report(1), report(2)) == [0, 1, 2]


def test_a_status_says_that_the_last_reports_are_missing() -> None:
    inbox = Inbox()
    inbox.take(report(0))
    inbox.take(status(4))
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (1, (1, 2, 3))


def test_only_what_is_on_the_disk_is_acknowledged(tmp_path: Path) -> None:
    inbox = Inbox(tmp_path)
    inbox.take(report(0))
    assert inbox.state((ROBOT, 1))[0] == 0
    inbox.settle()
    assert inbox.state((ROBOT, 1))[0] == 1


def test_a_report_that_cannot_be_kept_is_not_taken_and_is_taken_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(journal: Journal, data: bytes) -> None:
        raise JournalError("full")

    inbox = Inbox(tmp_path)
    inbox.take(report(0))
    monkeypatch.setattr(Journal, "add", full)
    with pytest.raises(JournalError):
        inbox.take(report(1))
    inbox.take(report(2))
    monkeypatch.undo()
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (1, (1,))
    assert numbers(inbox, report(1)) == [1, 2]
    assert [told.number for told in again(inbox, tmp_path).kept()] == [0, 1, 2]


def test_a_disk_that_is_full_while_a_gap_closes_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inbox, add, tries = Inbox(tmp_path), Journal.add, iter(range(9))

    def full_once(journal: Journal, data: bytes) -> None:
        if next(tries) == 1:
            raise JournalError("full")
        add(journal, data)

    assert numbers(inbox, report(0), report(2), report(3)) == [0]
    monkeypatch.setattr(Journal, "add", full_once)
    assert numbers(inbox, report(1)) == [1]
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (2, (2,))
    assert numbers(inbox, report(2), report(3), report(4)) == [2, 3, 4]
    assert [told.number for told in again(inbox, tmp_path).kept()] == [0, 1, 2, 3, 4]


def test_a_second_server_on_the_same_folder_is_refused_until_the_first_one_ends(tmp_path: Path) -> None:
    first = Inbox(tmp_path / "kept")
    with pytest.raises(JournalError, match="kept: another server keeps its reports there"):
        Inbox(tmp_path / "kept")
    again(first, tmp_path / "kept")


def test_two_files_of_one_run_are_refused_and_both_named(tmp_path: Path) -> None:
    for name in ("1.facts", "2.facts"):
        Journal(tmp_path / name).add(report(0))
    with pytest.raises(JournalError, match=r"2\.facts: is of the same run as 1\.facts"):
        Inbox(tmp_path)


def test_a_folder_that_cannot_be_written_is_told_of_before_anything_comes(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(JournalError, match="cannot be"):
        Inbox(tmp_path / "file")


def test_messages_are_taken_while_the_disk_takes_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inbox = Inbox(tmp_path)
    monkeypatch.setattr(Journal, "settle", lambda journal: inbox.take(report(1)))
    inbox.take(report(0))
    inbox.settle()
    assert inbox.state((ROBOT, 1)) == (1, ())  # what came meanwhile is not acknowledged yet


def test_another_content_under_the_same_number_is_a_fault_and_the_first_is_kept() -> None:
    inbox = Inbox()
    inbox.take(report(0))
    inbox.take(report(2))
    for number in (0, 2):
        taken = inbox.take(report(number, stamp=5.0))
        assert taken.reports == ()
        assert "two robots have this name" in taken.fault
    told = inbox.take(report(1)).reports
    assert [encode(each) for each in told] == [report(1), report(2)]


def test_two_robots_of_one_name_that_drive_at_once_are_told_of() -> None:
    inbox = Inbox()
    faults = [inbox.take(status(number, run)).fault for number in range(1, 2 * TURNS) for run in (1, 2)]
    assert "two drives at once" in faults[-1]


@pytest.mark.parametrize("began", [100.0, -100.0], ids=["later", "its clock was set back"])
def test_a_robot_that_begins_anew_is_not_taken_for_two_whatever_comes_late_and_though_the_server_begins_anew(
    tmp_path: Path, began: float
) -> None:
    inbox, faults = Inbox(tmp_path), []

    def tell(number: int, run: int, stamp: float) -> None:
        faults.append(inbox.take(report(number, run, stamp=stamp)).fault)

    def say(count: int, run: int, stamp: float) -> None:
        faults.append(inbox.take(status(count, run, stamp=stamp)).fault)

    for number in range(5):
        tell(number, 1, number)
        say(number + 1, 1, number)
    for number in range(20):
        if number == 10:
            inbox.close()
            inbox = Inbox(tmp_path)
        tell(number, 2, began + number)
        say(number + 1, 2, began + number)
        tell(5 + number, 1, 5.0 + number)  # what had waited
        say(25, 1, 25.0)
    assert faults == [""] * len(faults)


def test_beyond_a_gap_only_so_much_is_held() -> None:
    inbox = Inbox()
    for number in range(1, 2 * AHEAD):
        inbox.take(report(number))
    assert numbers(inbox, report(0)) == list(range(AHEAD))


def test_beyond_a_gap_only_so_many_bytes_are_held() -> None:
    points = np.random.default_rng(0).normal(size=(15_000, 4)).astype(np.float32)
    large = KeyframeFact(0, 0.0, np.zeros(3), 0.0, points, np.zeros((0, 13), np.float32))
    messages = [encode(Report(ROBOT, 1, number, (large,))) for number in range(1, 40)]
    room = AHEAD_BYTES // len(messages[0])
    assert room < len(messages) - 2
    inbox = Inbox()
    assert numbers(inbox, *messages) == []
    assert room - 2 <= len(numbers(inbox, report(0))) <= room + 2


def test_answers_are_none_of_the_inbox() -> None:
    answer = Answer(ROBOT, 1, 0, (), 0, (), -1, np.zeros(3), np.eye(3))
    assert "only a server sends" in Inbox().take(encode(answer)).fault


def test_a_file_whose_reports_are_not_in_their_places_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "x.facts")
    journal.add(report(1))
    with pytest.raises(JournalError, match="not in its place"):
        Inbox(tmp_path)


def unreadable(number: int) -> bytes:
    """A report whose envelope and number are sound, and whose facts are of no kind."""
    writer = Writer(np.array(SIZES))
    writer.put(-NUMBER_BITS, number)
    writer.count(FACT, 1, 1)
    writer.put(FACT, 9)
    body = bytes([len(ROBOT)]) + ROBOT.encode() + (1).to_bytes(8, "little") + writer.packed()
    return HEAD.pack(MAGIC, VERSION, b"R", zlib.crc32(b"R" + body)) + body


def test_a_kept_report_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inbox, decoded = Inbox(tmp_path), []
    numbers(inbox, *(report(number) for number in range(5)))
    monkeypatch.setattr(wire_module, "take_facts", lambda reader: decoded.append(reader) or take_facts(reader))
    inbox = again(inbox, tmp_path)
    assert inbox.state((ROBOT, 1)) == (5, ())
    assert not decoded
    assert len(list(inbox.kept())) == len(decoded) == 5


def test_a_kept_report_of_no_known_facts_is_refused_when_it_is_taken_up(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "0-x.facts")
    journal.add(report(0))
    journal.add(unreadable(1))
    inbox = Inbox(tmp_path)
    with pytest.raises(JournalError, match=r"0-x\.facts: holds what this program cannot read: a fact in it"):
        list(inbox.kept())
    inbox.close()


def test_a_server_that_cannot_read_what_was_kept_lets_go_of_the_folder(tmp_path: Path) -> None:
    Journal(tmp_path / "0-x.facts").add(unreadable(0))
    for _ in range(2):  # a folder that is still held would be told of instead
        with pytest.raises(JournalError, match="cannot read"):
            FleetServer(inbox=Inbox(tmp_path))


def test_a_file_that_holds_something_else_than_reports_is_refused(tmp_path: Path) -> None:
    Journal(tmp_path / "x.facts").add(status(1))
    with pytest.raises(JournalError, match="no report"):
        Inbox(tmp_path)


def test_runs_are_taken_up_in_the_order_in_which_they_came(tmp_path: Path) -> None:
    robots = "zoe", "adam", "mary"
    inbox = Inbox(tmp_path)
    for robot in robots:
        inbox.take(encode(Report(robot, 5, 0, ())))
    inbox = again(inbox, tmp_path)
    assert tuple(told.robot for told in inbox.kept()) == robots
    inbox.take(encode(Report("abel", 5, 0, ())))
    assert tuple(told.robot for told in again(inbox, tmp_path).kept()) == (*robots, "abel")
