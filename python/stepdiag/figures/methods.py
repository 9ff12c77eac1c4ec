"""`plot()` of results, attached when stepdiag is imported. matplotlib is imported when one is called."""

from typing import TYPE_CHECKING, Any

from stepdiag._core import Adjustment, Calibration, ErrorMap, Measurement
from stepdiag.style import draw_values_with, drawn

if TYPE_CHECKING:
    import matplotlib.figure


def calibration_plot(self: Calibration, *, truth: ErrorMap | None = None) -> "matplotlib.figure.Figure":
    """Draw the 21 parameters with 95 % bands (a matplotlib Figure). truth: errors to draw beside them."""
    return drawn(self, truth=truth)


def measurement_plot(self: Measurement, *, adjustment: Adjustment | None = None) -> "matplotlib.figure.Figure":
    """Draw the readings, or with the adjustment of this measurement its residuals (a matplotlib Figure)."""
    return drawn(self, adjustment=adjustment)


def draw(value: Any, **options: Any) -> "matplotlib.figure.Figure":
    """The figure of a result, by its type."""
    from stepdiag.calibration.comparison import Comparison
    from stepdiag.calibration.volume import VolumeErrors

    if isinstance(value, Calibration):
        from stepdiag.figures.calibration import draw_calibration

        return draw_calibration(value, **options)
    if isinstance(value, Measurement):
        from stepdiag.figures.measurement import draw_measurement

        return draw_measurement(value, **options)
    if isinstance(value, Comparison):
        from stepdiag.figures.comparison import draw_comparison

        return draw_comparison(value)
    if isinstance(value, VolumeErrors):
        from stepdiag.figures.volume import draw_volume

        return draw_volume(value)
    from stepdiag.figures.uncertainty import draw_uncertainty

    return draw_uncertainty(value)


def attach() -> None:
    """Give the results of the package their method `plot`."""
    Calibration.plot = calibration_plot  # type: ignore[method-assign]
    Measurement.plot = measurement_plot  # type: ignore[method-assign]
    draw_values_with(draw)
