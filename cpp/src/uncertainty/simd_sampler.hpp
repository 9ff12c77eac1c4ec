// The fast way: the readings of `run_lanes` samples at once, one a lane, every pose by replay (lane_kernels).
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "uncertainty/simd_pass.hpp"
#include "uncertainty/beam_paths.hpp"

namespace stepdiag {

class LaneRun {
public:
    // None where a head has to be read the general way (record_ways), or all poses are to be traced.
    static std::unique_ptr<const LaneRun> make(const RunModel& model);

    // What a thread writes to.
    class Scratch {
    public:
        explicit Scratch(const LaneRun& run);

    private:
        friend class LaneRun;
        // A head's numbers by lane, and the beams that point at them.
        struct HeadRows {
            std::vector<LaneRow> rows;
            std::vector<LaneBeam> beams;
            LaneRow* index_ratio = nullptr;  // closed layouts
            LaneRow* psd_distance = nullptr;
            LaneRow* beam_offsets = nullptr;
        };
        std::vector<HeadRows> heads;
        std::vector<std::vector<LaneRow>> slots;  // by line
        std::vector<LaneSetup> setups;
        std::vector<std::vector<LaneRow>> closed_beams;  // by line, gain included
        std::vector<LaneRow> shared;
        std::vector<LaneRow> displaced;
        std::vector<LaneRow> excess;
        std::vector<LaneRow> numbers;  // drawn
    };

    // Readings without noise: [(row * channels + channel) * run_lanes + lane]. `deviations`: [input * run_lanes +
    // lane]. `first_sample`: of the displacements of the tool that are drawn; none: none are. `followed` becomes 0 for
    // lanes that have to be read the general way.
    void trace(const double* deviations, std::optional<std::uint64_t> first_sample, Scratch& scratch, double* readings,
               std::uint8_t* followed) const;
    // Adds the reading noise.
    void add_noise(std::uint64_t first_sample, Scratch& scratch, double* readings) const;

private:
    struct Line {
        LineFrame frame;
        std::size_t head;
        bool setup_varies, corrects;
    };

    explicit LaneRun(const RunModel& model) : model_(model) {}
    void prepare_head(const HeadWays& ways, Scratch::HeadRows& to) const;
    void fill_head(const HeadWays& ways, const double* deviations, const Scratch& scratch, Scratch::HeadRows& to) const;
    void fill_air(const HeadWays& ways, const Scratch& scratch, Scratch::HeadRows& to) const;
    void move_parts(const HeadWays& ways, const double* deviations, Scratch::HeadRows& to) const;
    void fill_slots(const Slots& slots, const double* deviations, std::vector<LaneRow>& to) const;
    void displace(std::optional<std::uint64_t> first_sample, Scratch& scratch) const;
    void correct(const RunVisit& visit, const LaneVisit& lanes, const Scratch& scratch) const;

    const RunModel& model_;
    std::vector<HeadWays> heads_;
    std::vector<Line> lines_;
    std::vector<ToolPose> poses_;
    std::vector<double> elapsed_, travel_, is_last_;
    std::vector<std::uint8_t> is_distance_;
    bool heads_vary_, reads_excess_;
};

}  // namespace stepdiag
