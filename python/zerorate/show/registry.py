"""Tables and figures of each result, registered in `zerorate.views`."""

from typing import Final

from zerorate.views import View, register

VIEWS: Final = {
    "array.accelerometers.FusedAccelerometers": (
        "series_views:format_fused",
        "series_views:plot_fused",
    ),
    "array.covariance.AllanCovariance": (
        "curve_views:format_allan_covariance",
        "curve_views:plot_allan_covariance",
    ),
    "array.rotations.Rotations": ("array_table:format_rotations", "interval_views:plot_rotations"),
    "array.virtual_gyro.VirtualGyro": (
        "interval_views:format_virtual_gyro",
        "interval_views:plot_virtual_gyro",
    ),
    "attitude.estimate.AttitudeEstimate": (
        "attitude_table:format_attitude",
        "attitude_figure:plot_attitude",
        "attitude_view:attitude_view",
    ),
    "calibration.calibration.Calibration": (
        "calibration_table:format_calibration",
        "calibration_figure:plot_calibration",
    ),
    "calibration.comparison.CalibrationComparison": (
        "calibration_comparison:format_comparison",
        "interval_views:plot_comparison",
    ),
    "calibration.magnetometer.MagnetometerCalibration": (
        "magnetometer_table:format_magnetometer",
        "magnetometer_figure:plot_magnetometer",
    ),
    "calibration.rate.angle.Integrated": (
        "series_views:format_integrated",
        "series_views:plot_integrated",
    ),
    "calibration.rate.rate_table.RateTable": (
        "rate_tables:format_rate_table",
        "rate_table_figure:plot_rate_table",
    ),
    "calibration.rate.reference.FittedRate": (
        "rate_tables:format_fitted_rate",
        "interval_views:plot_fitted_rate",
    ),
    "calibration.temperature.model.TemperatureModel": (
        "temperature_table:format_temperature",
        "temperature_figure:plot_temperature",
    ),
    "checks.result.Checks": ("checks_table:format_checks", "checks_figure:plot_checks"),
    "tasks.compare.comparison.Comparison": (
        "compare_tables:format_comparison",
        "compare_figure:plot_compare",
    ),
    "denoising.wavelet.Denoised": ("series_views:format_denoised", "series_views:plot_denoised"),
    "findings.before_after.BeforeAfter": (
        "before_after_page:format_before_after",
        "before_after_page:plot_before_after",
        "before_after_page:before_after_page",
    ),
    "findings.report.Report": (
        "report_page:format_report",
        "report_page:plot_report",
        "report_page:report_page",
    ),
    "identification.arma_model.ArmaModel": (
        "arma_table:format_arma_model",
        "curve_views:plot_arma_model",
    ),
    "identification.identification.Identification": (
        "identify_tables:format_identification",
        "identify_figure:plot_identification",
    ),
    "linear.run.LinearRun": ("series_views:format_linear", "series_views:plot_linear"),
    "linear.run.SmoothedRun": ("series_views:format_smoothed", "series_views:plot_smoothed"),
    "foot.feet.Feet": ("feet_views:format_feet", "feet_views:plot_feet"),
    "foot.foot.FootTrack": ("foot_table:format_foot", "foot_figure:plot_foot"),
    "navigation.outage.Outages": (
        "navigation_table:format_outages",
        "navigation_figure:plot_outages",
    ),
    "navigation.alignment.Alignment": (
        "navigation_table:format_alignment",
        "interval_views:plot_alignment",
    ),
    "record.log.Log": ("series_views:format_log", "series_views:plot_log"),
    "record.offset.TimeOffset": (
        "navigation_table:format_time_offset",
        "interval_views:plot_time_offset",
    ),
    "navigation.track.Track": ("navigation_table:format_track", "navigation_figure:plot_track"),
    "noise.dynamic.DynamicAllan": ("curve_views:format_dynamic", "dynamic_figure:plot_dynamic"),
    "noise.model.NoiseModel": (
        "noise_model_table:format_noise_model",
        "curve_views:plot_noise_model",
    ),
    "noise.result.AllanResult": ("curve_views:format_allan_result", "allan_figure:plot_allan"),
    "tasks.characterise.Characterisations": (
        "overlay:format_characterisations",
        "overlay:plot_characterisations",
    ),
    "tasks.characterise.Characterised": (
        "allan_table:format_characterised",
        "allan_figure:plot_characterised",
    ),
    "tasks.compare.task.Compared": (
        "compare_simulated:format_compared",
        "compare_figure:plot_compared",
    ),
    "tasks.identify.Identified": (
        "identify_tables:format_identified",
        "identify_figure:plot_identified",
        "identify_page:identified_page",
    ),
    "tasks.navigate.Navigation": (
        "navigation_table:format_navigation",
        "navigation_figure:plot_navigation",
    ),
    "tasks.batch.run.BatchResult": (
        "batch_views:format_batch",
        "batch_views:plot_batch",
        "overview_page:overview_page",
    ),
    "tasks.calibrate.Corrected": (
        "calibration_table:format_corrected",
        "series_views:plot_corrected",
    ),
    "tasks.array.ArrayReplay": ("array_table:format_array_replay", "array_figure:plot_array"),
    "tasks.trace.Trace": ("series_views:format_trace", "series_views:plot_trace"),
    "tasks.replay.result.Replay": ("replay_table:format_replay", "replay_figure:plot_replay"),
    "tasks.replay.result.Replays": ("replay_table:format_replays", "biases_figure:plot_replays"),
    "tasks.replay.result.Summary": ("replay_table:format_replay", "biases_figure:plot_summary"),
}
"""Functions of this package that show each result, by the result's module and class."""

MAIN_PANELS: Final = {
    "calibration.calibration.Calibration": 1,
    "identification.identification.Identification": 1,
    "tasks.identify.Identified": 1,
    "tasks.replay.result.Replay": 1,
}
"""Index of a figure's main panel, if it is not the first panel."""


def _make_view(name: str) -> View:
    table, figure, *page = (f"zerorate.show.{place}" for place in VIEWS[name])
    return View(table, figure, page[0] if page else "", MAIN_PANELS.get(name, 0))


register(
    "zerorate",
    {name: _make_view(name) for name in VIEWS},
    columns="zerorate.show.columns:columns_of",
    panels="zerorate.show.given_axes:draw_into",
)
