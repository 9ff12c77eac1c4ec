// The reduction of raw channels to lengths and tilts (passes.cpp, measurement/reading.cpp) for many sets of readings of
// one pattern, a set a lane. Internal.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "evaluation/passes.hpp"
#include "stepdiag/core/random_blocks.hpp"

namespace stepdiag {

// How one row of the measurement is reduced.
struct ReducedRow {
    enum Kind : std::uint32_t { distance, tilts, distance_and_tilts, spot, beams };
    Kind kind;
    std::uint32_t raws;      // raw channels that it takes
    std::uint32_t place;     // of its length among the inputs of the linear map; alpha and beta follow
    bool by_distance_alone;  // LengthKind::distance
    double lateral_x, lateral_y, travel;
    double psd_distance, spot_beam_x, spot_beam_y;
    bool is_beside;  // the beam that makes the spot, beside the axis
};

class SimdReduction {
public:
    // Rows and channels are those of `pattern`, from which `passes` were collected.
    SimdReduction(const Measurement& pattern, const HeadCalibrations& heads, const std::vector<Pass>& passes,
                  LengthKind kind);

    // lane_group sets, from readings[raw * stride + lane] to inputs[place * lane_group + lane]. `lost`: the lanes
    // that no mirror gives, or with a reading that counts and is not finite.
    using Lost = std::array<bool, lane_group>;
    Lost reduce(const double* readings, std::size_t stride, double* inputs) const;

    // --- for the code that runs it
    const std::vector<ReducedRow>& rows() const { return rows_; }
    const std::uint32_t* raws() const { return raws_.data(); }     // row by row: row * channels + channel
    const double* solutions() const { return solutions_.data(); }  // of rows of beams: (distance, a, b) by each beam

private:
    std::vector<ReducedRow> rows_;
    std::vector<std::uint32_t> raws_;
    std::vector<double> solutions_;
};

}  // namespace stepdiag
