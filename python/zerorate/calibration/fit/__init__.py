"""From a record to its calibration: rests, turns between them, one fit, and its assessment.

``sensors`` are the samples, ``rests`` and ``turns`` what is found in them, ``starts`` what is
believed before; ``joint_fit`` and ``g_sensitivity`` are the mathematics, ``expected`` what the fit
may err by, ``solution`` decides what is fitted, ``assessment`` checks its validity,
``assembly`` makes the result, and ``steps`` is the way through all of them.
"""
