"""What a sweep found: its table of runs read back, held together per cell, tested in pairs, and shown as a page.

``values`` is the sweep as it is needed here, ``reading`` takes it from its results, ``measures`` says what can be
compared, ``statistics`` how sure it is; ``figures``, ``tables``, ``findings`` and ``sections`` show it, ``page`` and
``markdown`` write it.
"""
