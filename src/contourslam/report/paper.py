"""The numbers printed in the paper, to stand beside ours."""

TABLE_I: dict[str, dict[str, float]] = {
    "matched_filter": {"x": 0.071, "y": 0.071, "theta": 0.016},
    "wu": {"x": 0.171, "y": 0.112, "theta": 0.024},
    "teh_chin": {"x": 0.522, "y": 0.272, "theta": 0.052},
    "curvature_scale_space": {"x": 0.235, "y": 0.317, "theta": 0.050},
}
"""Table I: RMSE of x (m), y (m) and heading (rad), one run per detector."""
