"""A joint of two maps as figures, and its evidence as a sentence."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from contourslam.joining.joint import Joint


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
