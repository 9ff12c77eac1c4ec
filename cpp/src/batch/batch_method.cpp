#include "batch/batch_method.hpp"

namespace stepdiag {

BatchMethod::BatchMethod(Calibration calibration)
    : entries(calibration_entries(calibration)), of_pattern(std::move(calibration)) {}

std::vector<int> signal_channels(const Measurement& measurement) {
    std::vector<int> signals;
    for (std::size_t c = 0; c < measurement.channels().size(); ++c)
        if (is_signal(measurement.channels()[c].name)) signals.push_back(int(c));
    return signals;
}

}  // namespace stepdiag
