#include "batch/batch_method.hpp"

namespace stepdiag {

BatchMethod::BatchMethod(Calibration calibration)
    : entries(calibration_entries(calibration)), of_pattern(std::move(calibration)) {}

std::vector<int> signal_channels(const Measurement& measurement) {
    std::vector<int> signals;
    for (std::size_t c = 0; c < measurement.channels().size(); ++c)
        if (const std::string& name = measurement.channels()[c].name; name != "time" && name != "temperature")
            signals.push_back(int(c));
    return signals;
}

}  // namespace stepdiag
