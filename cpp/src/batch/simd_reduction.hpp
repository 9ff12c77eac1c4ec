// Reduces raw channels to lengths and tilts (passes.cpp, measurement/reading.cpp) for many sets of readings of one
// pattern, one set in each lane. Internal.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "evaluation/passes.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// Reduction of one row of the measurement.
struct ReducedRow {
    enum Kind : std::uint32_t { distance, tilts, distance_and_tilts, spot, beams };
    Kind kind;
    std::uint32_t raws;      // number of its raw channels
    std::uint32_t place;     // of its length among the inputs of the linear map; alpha and beta follow
    bool by_distance_alone;  // LengthKind::distance
    double lateral_x, lateral_y, travel;
    double psd_distance, spot_beam_x, spot_beam_y;
    bool is_beside;  // whether the beam that makes the spot is beside the axis
};

class SimdReduction {
public:
    // Rows and channels are those of `pattern`, from which `passes` were collected.
    SimdReduction(const Measurement& pattern, const HeadCalibrations& heads, const std::vector<Pass>& passes,
                  LengthKind kind);

    // Reduces lane_group sets, from readings[raw * stride + lane] to inputs[place * lane_group + lane]. `lost`: lanes
    // with readings that no mirror gives, or that count and are not finite.
    using Lost = std::array<bool, lane_group>;
    Lost reduce(const double* readings, std::size_t stride, double* inputs) const;

    // --- for the code that executes it
    const std::vector<ReducedRow>& rows() const { return rows_; }
    const std::uint32_t* raws() const { return raws_.data(); }  // for each row: row * channels + channel
    const double* solutions() const {
        return solutions_.data();
    }  // for each row of beams: (distance, a, b) by each beam

private:
    std::vector<ReducedRow> rows_;
    std::vector<std::uint32_t> raws_;
    std::vector<double> solutions_;
};

}  // namespace stepdiag
