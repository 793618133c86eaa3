"""From a record to its calibration: rests, rotations between them, one fit, and its assessment.

- ``sensors``: the samples.
- ``rests``, ``turns``: intervals found in the samples.
- ``priors``: start values of the fit.
- ``joint_fit``, ``g_sensitivity``: the mathematics.
- ``expected_errors``: errors expected of a fit.
- ``solution``: choice of the fitted parameters.
- ``assessment``: validity of the result.
- ``assembly``: the result.
- ``steps``: all steps in order.
"""
