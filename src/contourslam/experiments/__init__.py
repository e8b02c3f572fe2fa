"""The paper's comparison and those around it, each one function from configuration to result.

``compare`` over seeds; on one drive ``noise``, ``refinement`` and ``adaptation``; ``study`` runs them all. They need
the extras ``simulation`` and ``report``.
"""
