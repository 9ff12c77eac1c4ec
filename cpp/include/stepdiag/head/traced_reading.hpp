// The signals of a traced head: from the light that comes back (traced_head) through its detectors to what it says.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stepdiag/head/head.hpp"
#include "stepdiag/head/nominal_head.hpp"
#include "stepdiag/head/traced_head.hpp"

namespace stepdiag {

struct ReadingConditions {
    Environment environment;             // what the light runs in
    std::optional<Environment> assumed;  // what readings are reduced with; none: the same
    ReplayOptions replay;
    std::uint64_t noise_seed = 0;  // of the sensors' own noise
};

class TracedReader {
public:
    // `head.design` must be there.
    TracedReader(const Head& head, const Eigen::Vector2d& mirror, const ReadingConditions& conditions);

    // One row a pose, without the constants and the noise of a line. `first_row` counts the sensors' noise on.
    std::vector<SignalRow> read(const std::vector<MirrorPose>& mirrors, std::uint64_t first_row = 0,
                                ReplayCount* count = nullptr) const;
    // The same by the Embree trace of every pose.
    SignalRow trace(const MirrorPose& mirror) const;

    const TracedHead& head() const { return traced_; }

private:
    void detect(int beam, const ArrivalTable::Row& arrivals, std::uint64_t row, SignalRow& signals) const;

    TracedHead traced_;
    NominalHead nominal_;
    ReadingConditions conditions_;
};

}  // namespace stepdiag
