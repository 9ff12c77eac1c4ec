// Signals of a traced head: its detectors' readings of the light that returns (traced_head.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stepdiag/head/head.hpp"
#include "stepdiag/head/nominal_head.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

struct ReadingConditions {
    Environment environment;             // the true air
    std::optional<Environment> assumed;  // the air used to reduce the readings; empty: the true air
    ReplayOptions replay;
    std::uint64_t noise_seed = 0;  // of the sensors' own noise
};

class TracedReader {
public:
    // `head` must have a design. `mirror`: width and height, mm.
    TracedReader(const Head& head, const Eigen::Vector2d& mirror, const ReadingConditions& conditions);

    // One row for each pose, without the constants and the noise of a line. `first_row`: number of the first row, on
    // which the sensors' noise depends.
    std::vector<SignalRow> read(const std::vector<MirrorPose>& mirrors, std::uint64_t first_row = 0,
                                ReplayCount* count = nullptr) const;
    // The same for one pose, by the Embree trace.
    SignalRow trace(const MirrorPose& mirror) const;

    const TracedHead& head() const { return traced_; }

private:
    void detect(int beam, const ArrivalTable::Row& arrivals, std::uint64_t row, SignalRow& signals) const;

    TracedHead traced_;
    NominalHead nominal_;
    ReadingConditions conditions_;
};

}  // namespace stepdiag
