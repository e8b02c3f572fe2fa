"""What was found out about two maps as figures, and its evidence as a sentence."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from contourslam.joining.groups import LeftOut
from contourslam.joining.joint import Apart, Joint


def joint_figures(joint: Joint) -> dict[str, Any]:
    """Give a joint as it stands in JSON: method, pose, number of ties, and each part of its evidence by its name."""
    return {"method": joint.method, "pose": joint.pose, "ties": len(joint.ties), **asdict(joint.evidence)}


def apart_in_words(told: Mapping[str, Any]) -> str:
    """Tell why two maps stay apart, from the reason and the best way of laying them, in a line."""
    return told["reason"] if told["best"] is None else f"{told['reason']}: at best {evidence_in_words(told['best'])}"


def evidence_in_words(figures: Mapping[str, Any]) -> str:
    """Tell the evidence among the figures of a joint in a line."""
    return (
        f"{figures['corners']} corners, {figures['walls']} walls, {figures['agreeing']:.1f} m of surfaces agree, "
        f"{figures['contradicted']:.1%} contradicted, {figures['way']:.1f} m of way, best rival {figures['rival']:.0%}"
    )


@dataclass(frozen=True)
class Verdict:
    """What became of a pair of maps.

    Attributes
    ----------
    names : (str, str)
    found : Joint, Apart or int
        Of maps that hold the same drive, how many keyframes they share.
    left_out : LeftOut or None
        Where the joint contradicts surer ones.
    """

    names: tuple[str, str]
    found: Joint | Apart | int
    left_out: LeftOut | None

    def as_json(self) -> dict[str, Any]:
        """Give the verdict with its evidence."""
        told: dict[str, Any] = {"maps": self.names}
        if isinstance(self.found, int):
            return told | {"joined": True, "shared_keyframes": self.found}
        if isinstance(self.found, Joint):
            told |= {"joined": self.left_out is None, **joint_figures(self.found)}
            if self.left_out is not None:
                told |= {"reason": "contradicts others", "off": self.left_out.off, "sigma": self.left_out.sigma}
            return told
        best = None if self.found.best is None else joint_figures(self.found.best)
        return told | {"joined": False, "reason": self.found.reason, "best": best}

    def __str__(self) -> str:
        who = f"{self.names[0]} and {self.names[1]}: "
        if isinstance(self.found, int):
            return who + f"joined, both hold the same drive ({self.found} keyframes)"
        if isinstance(self.found, Joint):
            if self.left_out is None:
                return who + f"joined by {self.found.method}: {_evidence(self.found)}"
            off, sigma = (math.hypot(*row[:2]) for row in (self.left_out.off, self.left_out.sigma))
            return who + f"left out, {off:.2f} m off what surer joints say (σ {sigma:.2f} m): {_evidence(self.found)}"
        return who + f"apart, {apart_in_words(self.as_json())}"


def _evidence(joint: Joint) -> str:
    return evidence_in_words(joint_figures(joint))
