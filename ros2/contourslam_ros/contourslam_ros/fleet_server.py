"""Node ``fleet_server``: joins what several robots map, and tells each where it is in the map that they share."""

import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from contourslam_msgs.msg import FleetPacket
from contourslam_msgs.srv import SaveMap
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future

from contourslam.errors import ContourslamError, JournalError, MessageError
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.rehearsal import rehearse
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import encode
from contourslam.maps.file import save_map
from contourslam_ros.fleet_health import FleetHealth, State
from contourslam_ros.fleet_maps import FleetMaps
from contourslam_ros.fleet_settings import FleetConfig
from contourslam_ros.fleet_topics import QUALITY, REPORTS, answers_to, packet
from contourslam_ros.messages import diagnostic_message, header
from contourslam_ros.running import run
from contourslam_ros.settings import Settings, declare

MOST_WAITING = 10_000  # packets; robots send again what is lost
RESTING = 1.0  # s between two looks while nothing comes


class Server(Node):
    """A node around a :class:`contourslam.fleet.server.FleetServer`.

    The node's thread takes in packets and makes topics; another one keeps and works up what came, answers and draws.

    Raises
    ------
    ContourslamError
        If a parameter is wrong, or what was kept cannot be read.

    Attributes
    ----------
    failure : BaseException or None
        Why the node cannot go on.
    """

    def __init__(self) -> None:
        super().__init__("fleet_server")
        self.config = declare(self, FleetConfig())
        self.failure: BaseException | None = None
        self._server = FleetServer(inbox=Inbox(self.config.path), sites=self.config.sites_of_robots())
        self._health = FleetHealth(REPORTS, self.config.silent_after)
        self._packets: deque[tuple[bytes, float]] = deque(maxlen=MOST_WAITING)
        self._answers: dict[str, Publisher] = {}
        self._answered = 0.0
        self._state = State()
        self._jobs: deque[tuple[Callable[[], str], Future]] = deque()
        self._news, self._ending = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="fleet", daemon=True)

    def warm_up(self) -> None:
        """Compile what is needed, and take up what was kept."""
        self.get_logger().info("warming up, which takes minutes when it is the first time on this machine")
        rehearse(Settings().core)
        self._server.flush(time.monotonic())
        kept = len(self._server.answers())
        if kept:
            self.get_logger().info(f"goes on with {kept} runs that were kept in {self.config.path}")

    def start(self) -> None:
        """Publish and subscribe; from here on robots are heard."""
        self._maps = FleetMaps(self, self.config)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_subscription(FleetPacket, REPORTS, self._take, QUALITY)
        self.create_service(SaveMap, "~/save", self._save)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._send_diagnostics, clock=steady)
        self.create_timer(self.config.answer_period, self._offer, clock=steady)
        self._thread.start()
        self.get_logger().info(f"ready: robots are heard on {REPORTS}, and kept in {self.config.path}")

    def stop(self) -> None:
        """End; all that was acknowledged is kept."""
        self._ending.set()
        self._news.set()
        if self._thread.is_alive():
            self._thread.join()

    def _take(self, message: FleetPacket) -> None:
        self._packets.append((bytes(message.data), time.monotonic()))
        self._news.set()

    def _offer(self) -> None:
        """Have the topics that are spoken on; in this thread, whose executor looks through what the node has."""
        said = self._state.answers
        for robot in {answer.robot for answer in said} - set(self._answers):
            self._answers[robot] = self.create_publisher(FleetPacket, answers_to(robot), QUALITY)
        self._maps.offer(said)

    # In the thread that works.

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                self._news.wait(RESTING)
                self._news.clear()
                began = time.monotonic()
                self._listen()
                self._server.tick(began, self.config.tick_period)
                if len(self._server.search):
                    self._news.set()
                self._work()
                self._answer()
                self._maps.send(self._server, self._state.answers)
                self._ending.wait(max(0.0, began + self.config.tick_period - time.monotonic()))
        except BaseException as error:  # nobody else hears of it in a thread
            self.failure = error

    def _listen(self) -> None:
        """Keep what has come. A packet that cannot be used is told of, and changes nothing."""
        while self._packets:
            data, came = self._packets.popleft()
            try:
                source = self._server.push(data)
            except JournalError as error:  # it is not acknowledged, so the robot tells it again
                self._health.fail(str(error))
            except MessageError as error:
                self._health.refuse(str(error), came)
            else:
                self._health.hear(source, len(data), came)

    def _answer(self) -> None:
        """Answer the robots that have spoken since they were answered last: what is on the disk is acknowledged."""
        now = time.monotonic()
        if now < self._answered + self.config.answer_period:
            return
        since, self._answered = self._answered, now
        try:
            said = self._server.answers()
        except JournalError as error:
            self._health.fail(str(error))
            return
        self._health.keep(sum(answer.received for answer in said))
        search = self._server.search
        self._state = State(said, self._server.joined(), len(search), search.given_up)
        for answer in said:
            if answer.robot in self._answers and self._health.heard_since((answer.robot, answer.run), since):
                self._answers[answer.robot].publish(packet(encode(answer)))

    def _work(self) -> None:
        while self._jobs:
            job, future = self._jobs.popleft()
            try:
                future.set_result((True, job()))
            except ContourslamError as error:
                future.set_result((False, str(error)))

    def _save_maps(self, folder: Path) -> str:
        maps = self._server.settle()
        if not maps:
            raise ContourslamError("no robot has told anything yet")
        for shared in maps:
            save_map(folder / f"{self.config.frame(shared.number)}.cmap", shared.saved)
        return f"{len(maps)} common map{'s' * (len(maps) > 1)} saved in {folder}"

    # In the node's thread.

    async def _save(self, request: SaveMap.Request, response: SaveMap.Response) -> SaveMap.Response:
        """Save each common map, refined, while robots are heard on."""
        folder = Path(request.path).expanduser().absolute() if request.path else self.config.path / "maps"
        future = Future()
        self._jobs.append((lambda: self._save_maps(folder), future))
        self._news.set()
        response.success, response.message = await future
        return response

    def _send_diagnostics(self) -> None:
        head = header(self.get_clock().now().to_msg(), "")
        told = self._health.diagnostics(self._state, self._server.faults(), time.monotonic())
        self._diagnostics.publish(diagnostic_message(head, self.get_fully_qualified_name(), told))


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Server)


if __name__ == "__main__":
    sys.exit(main())
