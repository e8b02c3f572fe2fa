"""Chi-square gates against SciPy."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.slam.gates import chi_square_gate

stats = pytest.importorskip("scipy.stats", reason="needs the extra 'report'")


@given(probability=st.floats(0.001, 0.99999), pairs=st.integers(1, 60))
def test_the_gate_is_the_quantile_of_the_chi_square_distribution(probability: float, pairs: int) -> None:
    assert chi_square_gate(probability, 2 * pairs) == pytest.approx(stats.chi2.ppf(probability, 2 * pairs), rel=1e-8)


@pytest.mark.parametrize(("probability", "gate"), [(0.95, 5.99), (0.99, 9.21), (0.999, 13.82)])
def test_the_gates_for_one_landmark_are_those_of_the_tables(probability: float, gate: float) -> None:
    assert chi_square_gate(probability, 2) == pytest.approx(gate, abs=0.005)


@pytest.mark.parametrize(("probability", "dof"), [(0.0, 2), (1.0, 2), (float("nan"), 2), (0.9, 0), (0.9, 3), (0.9, -2)])
def test_a_gate_that_does_not_exist_is_refused(probability: float, dof: int) -> None:
    with pytest.raises(ConfigError, match="no gate"):
        chi_square_gate(probability, dof)
