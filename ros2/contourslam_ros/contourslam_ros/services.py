"""Services of a node: save, load, pause, resume and reset."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from contourslam_msgs.srv import LoadMap, SaveMap
from rclpy.node import Node
from std_srvs.srv import Trigger

from contourslam.errors import ContourslamError
from contourslam.live.session import Session

Response = TypeVar("Response", Trigger.Response, SaveMap.Response, LoadMap.Response)


class Services:
    """Offers what a session can do, under the node's own name.

    Parameters
    ----------
    node : Node
    session : callable
        Gives the session; while there is none, it raises a ContourslamError.
    map_file : str
        File for those who name none.
    """

    def __init__(self, node: Node, session: Callable[[], Session], map_file: str) -> None:
        self._session, self._map_file = session, map_file
        node.create_service(Trigger, "~/pause", self._pause)
        node.create_service(Trigger, "~/resume", self._resume)
        node.create_service(Trigger, "~/reset", self._reset)
        node.create_service(SaveMap, "~/save", self._save)
        node.create_service(LoadMap, "~/load", self._load)

    def _pause(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._serve(
            response, lambda session: session.pause(), "paused: scans are left out until resume is called"
        )

    def _resume(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._serve(response, lambda session: session.resume(), "scans are taken in again")

    def _reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._serve(response, lambda session: session.reset(), "begun anew")

    def _save(self, request: SaveMap.Request, response: SaveMap.Response) -> SaveMap.Response:
        return self._serve(response, lambda session: session.save(self._path(request.path)), "saved")

    def _load(self, request: LoadMap.Request, response: LoadMap.Response) -> LoadMap.Response:
        return self._serve(response, lambda session: session.load(self._path(request.path)), "loaded")

    def _path(self, given: str) -> Path:
        path = given or self._map_file
        if not path:
            raise ContourslamError("no path was given, and the parameter map_file is empty")
        return Path(path).expanduser().absolute()

    def _serve(self, response: Response, work: Callable[[Session], None], done: str) -> Response:
        """Do what was asked; a known failure is told to the caller and changes nothing."""
        try:
            work(self._session())
        except ContourslamError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, done
        return response
